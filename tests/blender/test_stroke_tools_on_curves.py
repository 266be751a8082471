# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools on strokes that are curves of the newer type."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.scene.raw_strokes import raw_strokes
from liquid_splash_addon.blender.ui import stroke_tools
from liquid_splash_addon.core.sketch.tools import TOOLS
from tests.blender.sketching import line
from tests.blender.test_stroke_tools import EXACT, set_values, use, values_of
from tests.blender.test_stroke_tools import empty_scene as empty_scene  # a fixture


def add_curves(lines) -> bpy.types.Object:
    """Return an active curves object of the newer type, moved, with polylines and a speed."""
    data = bpy.data.hair_curves.new("Curves")
    data.add_curves([len(one.points) for one in lines])
    data.set_types(type="POLY")
    points = np.concatenate([one.points for one in lines]).astype(np.float32)
    data.position_data.foreach_set("vector", points.ravel())
    radii = data.attributes.get("radius") or data.attributes.new("radius", "FLOAT", "POINT")
    radii.data.foreach_set("value", np.full(len(points), 0.02, np.float32))
    set_values(data, "speed", "FLOAT", "POINT", np.full(len(points), 2.0, np.float32))
    set_values(data, "mine", "INT", "CURVE", np.arange(len(lines), dtype=np.int32))
    item = bpy.data.objects.new("Curves", data)
    bpy.context.collection.objects.link(item)
    item.location = (0, 0, 3)
    bpy.context.view_layer.objects.active = item
    bpy.context.view_layer.update()
    return item


def curves_in_world(item: bpy.types.Object) -> list[np.ndarray]:
    """Return the points of curves in the world."""
    matrix = np.array(item.matrix_world, dtype=float)
    strokes = raw_strokes(item.data, item.data.curve_offset_data)
    return [s.points @ matrix[:3, :3].T + matrix[:3, 3] for s in strokes]


def test_every_tool_works_on_curves():
    counts = {"SPIN": 12, "MIRROR": 4, "LIFT": 2, "FILL": 4, "RESAMPLE": 2, "REVERSE": 2}
    for name in TOOLS:
        item = add_curves([line((1, 0, 0), (2, 0, 0)), line((1, 0, 1), (2, 1, 1))])
        assert use(name.lower()) == {"FINISHED"}, name
        assert len(item.data.curves) == counts[name], name
        assert stroke_tools.SPLASH_PT_strokes.poll(bpy.context)


def test_curves_keep_what_they_have_and_lie_where_they_should():
    item = add_curves([line((1, 0, 0), (2, 0, 0), points=5), line((1, 0, 1), (3, 0, 1), points=3)])
    assert use("spin", count=4, **EXACT) == {"FINISHED"}
    np.testing.assert_array_equal(values_of(item.data, "mine"), [0, 0, 1, 1])
    np.testing.assert_allclose(values_of(item.data, "speed"), 2.0, rtol=1e-5)
    np.testing.assert_allclose(values_of(item.data, "radius"), 0.02, rtol=1e-5)
    tips = np.array([points[-1] for points in curves_in_world(item)])
    np.testing.assert_allclose(tips, [(2, 0, 3), (-2, 0, 3), (0, 3, 4), (0, -3, 4)], atol=1e-5)
    assert bpy.ops.splash.stroke_speed(multiplier=3.0) == {"FINISHED"}
    strokes = raw_strokes(item.data, item.data.curve_offset_data)
    assert {stroke.flow.multiplier for stroke in strokes} == {3.0}


def test_only_selected_curves_are_changed():
    item = add_curves([line((0, 0, z), (1, 0, z)) for z in range(3)])
    set_values(item.data, ".selection", "BOOLEAN", "CURVE", np.array([False, True, False]))
    use("reverse")
    assert [points[0, 0] for points in curves_in_world(item)] == [0, 1, 0]


def test_curves_of_the_older_type_are_told_apart():
    item = bpy.data.objects.new("Curve", bpy.data.curves.new("Curve", "CURVE"))
    bpy.context.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    with pytest.raises(RuntimeError, match="curves of the newer type"):
        use("spin")
    with pytest.raises(ValueError, match="Object > Convert > Curves"):
        stroke_tools.chosen_strokes(item)
