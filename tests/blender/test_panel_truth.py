# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel tells the truth: errors stay while their cause does, and old splashes are marked."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from liquid_splash_addon.blender.jobs import problems, staleness
from liquid_splash_addon.blender.scene.sketch import add_strokes
from liquid_splash_addon.blender.ui.panels import SPLASH_PT_info, SPLASH_PT_main
from tests.blender.drawing_panels import drawn
from tests.blender.sketching import (
    GAIN,
    add_sketch,
    fan,
    generate,
    line,
    slower,
    splashes,
    vertices,
)
from tests.blender.test_places import activate, off_sketch, regenerate, true_vertices

pytestmark = pytest.mark.usefixtures("tubes")


def fail(match: str) -> None:
    with pytest.raises(RuntimeError, match=match):
        bpy.ops.splash.generate(resolution="64")
    bpy.context.view_layer.update()


def test_an_error_stays_until_its_cause_is_gone():
    sketch = add_sketch([])
    fail("Draw at least one stroke")
    for _ in range(2):
        assert "Draw at least one stroke" in drawn(SPLASH_PT_main), "it is read later"
    other = add_sketch([])
    assert "Draw at least one stroke" not in drawn(SPLASH_PT_main), "nothing was tried with it"
    activate(sketch)
    sketch.location.x = 1
    bpy.context.view_layer.update()
    assert "Draw at least one stroke" in drawn(SPLASH_PT_main), "moving it did not help"
    add_strokes(sketch, fan())
    sketch.data.update_tag()
    bpy.context.view_layer.update()
    assert "Draw at least one stroke" not in drawn(SPLASH_PT_main)
    assert other is not None


def test_success_and_the_button_clear_it():
    sketch = add_sketch([])
    fail("Draw at least one stroke")
    assert bpy.ops.splash.dismiss() == {"FINISHED"}
    assert "Draw at least" not in drawn(SPLASH_PT_main)
    fail("Draw at least one stroke")
    add_strokes(sketch, fan())
    generate()
    activate(sketch)
    assert not problems.sentences({sketch.session_uid})


def test_strokes_outside_the_box_are_said_until_they_are_moved_back():
    splash = made()
    sketch = splash.splash.sketch
    drawing = sketch.data.layers[0].current_frame().drawing
    attribute = drawing.attributes["position"]
    values = np.empty(3 * len(attribute.data), dtype=np.float32)
    attribute.data.foreach_get("vector", values)
    attribute.data.foreach_set("vector", (values.reshape(-1, 3) * (9, 1, 1)).ravel())
    sketch.data.update_tag()
    bpy.context.view_layer.update()
    activate(splash)
    with pytest.raises(RuntimeError, match="Refit to Sketch"):
        bpy.ops.splash.regenerate()
    sketch.data.update_tag()
    bpy.context.view_layer.update()
    assert "have left their splash" in drawn(SPLASH_PT_main)
    attribute.data.foreach_set("vector", values)
    sketch.data.update_tag()
    bpy.context.view_layer.update()
    assert "have left their splash" not in drawn(SPLASH_PT_main)


def made() -> bpy.types.Object:
    add_sketch(fan())
    splash = generate()
    bpy.context.view_layer.update()
    return splash


MARK = "Out of Date"


def test_settings_that_were_not_used_yet_are_marked():
    splash = made()
    assert MARK not in drawn(SPLASH_PT_main)
    splash.splash.settings.speed_gain *= 2
    assert MARK in drawn(SPLASH_PT_main)
    splash.splash.settings.speed_gain /= 2
    assert MARK not in drawn(SPLASH_PT_main)
    splash.splash.settings.reach = 0.1
    regenerate(splash)
    assert MARK not in drawn(SPLASH_PT_main)


def test_changed_strokes_and_obstacles_are_marked():
    splash = made()
    sketch = splash.splash.sketch
    add_strokes(sketch, [line((0.2, -0.2, 0.1), (0.9, 0.3, 0.1))])
    sketch.data.update_tag()
    bpy.context.view_layer.update()
    activate(splash)
    assert MARK in drawn(SPLASH_PT_main)
    regenerate(splash)
    assert not staleness.is_out_of_date(splash)
    from tests.blender.test_obstacles import ball

    collection = ball()
    splash.splash_obstacles.collection = collection
    activate(splash)
    regenerate(splash)
    assert not staleness.is_out_of_date(splash)
    collection.objects[0].location.z += 0.1
    bpy.context.view_layer.update()
    assert staleness.is_out_of_date(splash)


def test_moving_what_follows_is_not_marked():
    splash = made()
    splash.splash.sketch.location.x += 1
    bpy.context.view_layer.update()
    activate(splash)
    assert MARK not in drawn(SPLASH_PT_main)


def test_next_and_previous_seed():
    splash = made()
    first = vertices(splash)
    assert bpy.ops.splash.step_seed() == {"FINISHED"}
    settings = splash.splash.settings
    assert (settings.seed, settings.variation) == (1, 0.5)
    second = vertices(splash)
    assert len(first) != len(second) or not np.array_equal(first, second)
    settings.variation = 0.25
    assert bpy.ops.splash.step_seed() == {"FINISHED"}
    assert bpy.ops.splash.step_seed(step=-1) == {"FINISHED"}
    assert (settings.seed, settings.variation) == (1, 0.25)
    assert bpy.ops.splash.step_seed(step=-1) == {"FINISHED"}
    assert bpy.ops.splash.step_seed(step=-1) == {"FINISHED"}
    assert settings.seed == 2**31 - 1, "it goes round"


@pytest.mark.parametrize("pace", [0.1, 1.0, 5.0])
def test_fit_speed_brings_strokes_into_the_trained_range(pace: float):
    add_sketch(slower(fan(), pace))
    splash = generate()
    activate(splash)
    assert ("Fit Speed" in splash.splash.warnings) == (pace == 0.1)
    assert bpy.ops.splash.fit_speed() == {"FINISHED"}
    regenerate(splash)
    assert "Fit Speed" not in splash.splash.warnings
    speed = np.linalg.norm(vertices(splash, "velocity"), axis=1) / splash.splash_motion.time_scale
    from liquid_splash_addon.blender.data.frame_text import frame_from_text

    local = speed * frame_from_text(splash.splash.frame).scale.speed
    assert 0.2 * 5.0 < np.median(local) <= 5.0


def test_too_fast_strokes_are_said_once_and_slow_ones_stay_another_splash():
    """Whatever is pressed; no speed is changed but by the button."""
    add_sketch(slower(fan(), 0.2))
    splash = generate()
    activate(splash)
    quick = vertices(splash).copy()
    for _ in range(2):
        said = " ".join(drawn(panel) for panel in (SPLASH_PT_main, SPLASH_PT_info))
        assert said.count("Strokes reach") == said.count("splash.fit_speed") == 1
        assert splash.splash.warnings.count("Fit Speed") == 1
        assert splash.splash.settings.speed_gain == GAIN
        regenerate(splash)
    add_sketch(slower(fan(), 4.0))
    generate()
    slow = next(item for item in splashes() if item != splash)
    assert not slow.splash.warnings
    assert vertices(slow).shape != quick.shape, "it has parted"
    assert slow.splash.settings.speed_gain == splash.splash.settings.speed_gain


def test_a_new_splash_follows_its_sketch_and_can_be_let_go():
    splash = made()
    sketch, off = splash.splash.sketch, off_sketch(splash)
    for matrix in (Matrix.Translation((3, 2, 1)), Matrix.Scale(2, 4), Matrix.Rotation(1, 4, "X")):
        sketch.matrix_world = matrix @ sketch.matrix_world
        bpy.context.view_layer.update()
        assert off_sketch(splash) == pytest.approx(off, abs=1e-4), "without a run"
    regenerate(splash)
    assert off_sketch(splash) == pytest.approx(off, rel=0.02, abs=1e-4)
    place = true_vertices(splash)
    assert bpy.ops.splash.follow(on=False) == {"FINISHED"}
    bpy.context.view_layer.update()
    np.testing.assert_allclose(true_vertices(splash), place, atol=1e-5)
    sketch.location.x += 5
    bpy.context.view_layer.update()
    np.testing.assert_allclose(true_vertices(splash), place, atol=1e-5)
    assert bpy.ops.splash.follow(on=True) == {"FINISHED"}
    bpy.context.view_layer.update()
    np.testing.assert_allclose(true_vertices(splash), place, atol=1e-5)


def test_following_is_a_choice_for_new_splashes():
    bpy.context.scene.splash.follow = False
    assert made().parent is None


def test_a_splash_stays_where_its_sketch_is_deleted():
    splash = made()
    sketch = splash.splash.sketch
    sketch.location.x = 4
    bpy.context.view_layer.update()
    place = true_vertices(splash)
    activate(sketch)
    bpy.ops.object.delete()
    bpy.context.view_layer.update()
    np.testing.assert_allclose(true_vertices(splash), place, atol=1e-5)


def test_undo_has_all_splashes_looked_at_soon(monkeypatch):
    add_sketch(fan())
    generate()
    asked = []
    monkeypatch.setattr(staleness, "look_soon", lambda: asked.append(True))
    staleness.look_at_all(bpy.context.scene)
    assert asked
