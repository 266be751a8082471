# SPDX-License-Identifier: GPL-3.0-or-later
"""The overlay of speeds: what it is told of strokes, and what it draws of that."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector

from liquid_splash_addon.blender.jobs import speed_map
from liquid_splash_addon.blender.ui import speed_overlay
from liquid_splash_addon.core.condition.trained_range import FAST
from liquid_splash_addon.core.progress import silent
from tests.blender.sketching import add_sketch, fan, generate, slower

SOMEWHERE = Matrix.LocRotScale(Vector((3, -2, 1)), Euler((0.4, -0.8, 1.9)), None)


@pytest.fixture(autouse=True)
def empty_scene():
    """Begin without objects, at a real size of 0.32 m."""
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    settings = bpy.context.scene.splash.settings
    before = settings.real_size
    settings.real_size = 0.32
    yield
    settings.real_size = before


def found() -> speed_map.SpeedMap:
    """Return the map of the active sketch."""
    bpy.context.view_layer.update()
    return speed_map.compute(speed_map.ask(bpy.context), silent)


def test_lines_lie_on_the_strokes_in_the_world_at_the_liquids_speed():
    drawings = fan(speed=0.5)
    add_sketch(drawings, SOMEWHERE)
    made = found()
    assert len(made.lines) == len(drawings) and made.fastest > 5
    matrix = np.array(SOMEWHERE)
    largest = max(np.ptp(np.concatenate([d.points for d in drawings]), axis=0))
    for line, drawing in zip(made.lines, drawings, strict=True):
        for end in (0, -1):
            np.testing.assert_allclose(
                line.points[end], matrix[:3, :3] @ drawing.points[end] + matrix[:3, 3], atol=1e-4
            )
        # Half a unit a second, at real size, four times as fast.
        expected = 0.5 * 4.0 * 0.32 / largest
        np.testing.assert_allclose(np.median(line.speeds), expected, rtol=0.25)


def test_half_the_speed_is_half_the_speed_shown():
    speeds = []
    for drawings in (fan(), slower(fan(), 2)):
        add_sketch(drawings)
        speeds.append(np.concatenate([line.speeds for line in found().lines]))
    np.testing.assert_allclose(speeds[0], 2 * speeds[1], rtol=1e-3)


def test_what_is_too_fast_is_drawn_in_the_warning_colour():
    add_sketch(fan(speed=0.5))
    shape = speed_overlay.geometry_of(found())
    assert not shape.faulty
    assert not (shape.line_colours == np.float32(speed_overlay.WARNING)).all(axis=1).any()
    add_sketch(fan(speed=30))
    shape = speed_overlay.geometry_of(found())
    assert shape.faulty == {FAST: 6}
    assert (shape.line_colours == np.float32(speed_overlay.WARNING)).all()
    assert len(shape.lines) == len(shape.line_colours) and len(shape.lines) % 2 == 0
    assert len(shape.arrows) == len(shape.arrow_colours) and len(shape.arrows) % 8 == 0


def test_the_splashs_own_frame_and_settings_count(tubes):
    add_sketch(fan())
    plain = found()
    splash = generate(speed_gain=bpy.context.scene.splash.settings.speed_gain / 2)
    bpy.context.view_layer.objects.active = splash.splash.sketch
    for one, other in zip(found().lines, plain.lines, strict=True):
        np.testing.assert_allclose(one.speeds, other.speeds / 2, rtol=0.01)


def test_nothing_is_asked_where_there_is_no_window():
    add_sketch(fan())
    assert speed_map.current(bpy.context) is None
    bpy.context.window_manager.splash_show_speed = True
    bpy.context.window_manager.splash_show_speed = False
    assert speed_map.ask(bpy.context) is not None
    add_sketch([])
    assert speed_map.ask(bpy.context) is None and speed_map.read().compute(silent) is None
