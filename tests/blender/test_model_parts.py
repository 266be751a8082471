# SPDX-License-Identifier: GPL-3.0-or-later
"""The splashes of a model: hidden and moved with it, deleted, removed, saved, undone."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Vector

from liquid_splash_addon.blender.jobs import compose, loaded_generator, refine
from liquid_splash_addon.blender.scene import model_parts
from liquid_splash_addon.core.composition.model import Composer
from liquid_splash_addon.core.refinement.presets import BARE
from tests.blender.modelling import bounds, crossing, generate_layers, part, the_model, volume
from tests.blender.sketching import add_sketch, bend, splashes, vertices

pytestmark = [pytest.mark.once, pytest.mark.usefixtures("thick_drafts")]


def test_a_deleted_part_is_left_out_said_and_can_be_removed():
    model = generate_layers(crossing())
    bpy.data.objects.remove(part("B"))
    model.splash_model.settings.blend = 1.0
    assert "'Splash B' was deleted" in model.splash_model.warnings
    assert "Left out" in model.splash_model.warnings
    assert volume(model) == pytest.approx(volume(part("A")), rel=0.02)
    bpy.context.view_layer.objects.active = model
    model.splash_model.active = 1
    assert bpy.ops.splash.part_remove() == {"FINISHED"}
    assert volume(model) == pytest.approx(volume(part("A")), rel=0.02)
    assert not model.splash_model.warnings


def test_a_removed_part_is_shown_where_it_stood():
    model = generate_layers(crossing())
    model.matrix_world = Matrix.Translation((0, 0, 5)) @ Matrix.Rotation(1, 4, "X")
    bpy.context.view_layer.update()
    place = model.matrix_world.copy()
    splash = part("B")
    bpy.context.view_layer.objects.active = model
    model.splash_model.active = 1
    assert bpy.ops.splash.part_remove() == {"FINISHED"}
    assert not splash.hide_viewport and not splash.hide_render and splash.parent is None
    assert part("A").hide_viewport
    bpy.context.view_layer.update()
    np.testing.assert_allclose(splash.matrix_world, place, atol=1e-5)
    assert bpy.ops.splash.part_add(splash=splash.name) == {"FINISHED"}
    assert splash.hide_viewport and splash.parent == model


def test_moving_the_model_or_a_splash():
    model = generate_layers(crossing())
    before = vertices(model)
    model.location = (1, 2, 3)
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = model
    assert bpy.ops.splash.model_update() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(model), before)
    part("B").location.z += 1.0
    part("B").scale = (2, 2, 2)
    assert bpy.ops.splash.model_update() == {"FINISHED"}
    assert bounds(model)[1, 2] > 0.95
    assert volume(model) == pytest.approx(volume(part("A")) + 8 * volume(part("B")), rel=0.02)
    part("B").scale = (2, 1, 1)
    assert bpy.ops.splash.model_update() == {"FINISHED"}
    assert "'Splash B' is stretched" in model.splash_model.warnings
    assert volume(model) == pytest.approx(volume(part("A")), rel=0.02), "the others are joined"
    model.splash_model.parts[0].show = False
    assert "stretched" in model.splash_model.warnings, "refused where none is left"


def test_the_splashes_are_shown_again_when_the_model_is_deleted():
    model = generate_layers(crossing())
    bpy.context.view_layer.update()
    bpy.data.objects.remove(model)
    bpy.context.view_layer.update()
    assert [item.hide_viewport or item.hide_render for item in splashes()] == [False, False]


def test_too_much_memory_leaves_everything_as_it_was(monkeypatch):
    sketch = crossing()
    monkeypatch.setattr(compose, "composer", Composer(most_memory=1 << 20))
    generate_layers(sketch)
    assert "GB" in the_model().splash_model.warnings
    assert not any(item.hide_viewport for item in splashes())
    bpy.data.objects.remove(the_model())
    bpy.context.view_layer.objects.active = sketch
    with pytest.raises(RuntimeError, match="GB"):
        bpy.ops.splash.combine()
    assert not any(item.splash_model.is_model for item in bpy.data.objects)
    assert all(item.parent is None and not item.hide_viewport for item in splashes())


def test_a_saved_file_goes_on_without_the_generator(tmp_path, monkeypatch):
    model = generate_layers(crossing())
    before, name = vertices(model), model.name
    path = str(tmp_path / "model.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    monkeypatch.setattr(compose, "composer", None)
    monkeypatch.setattr(compose, "_refined", {})
    monkeypatch.setattr(refine, "refiner", None)
    monkeypatch.setattr(loaded_generator, "get", None)
    bpy.ops.wm.open_mainfile(filepath=path)
    again = bpy.data.objects[name]
    np.testing.assert_array_equal(vertices(again), before)
    again.splash_model.parts[1].show = False
    assert vertices(again).shape != before.shape
    again.splash_model.parts[1].show = True
    np.testing.assert_array_equal(vertices(again), before)


def test_undo_and_redo():
    crossing()
    bpy.context.scene.splash.start = BARE
    bpy.ops.ed.undo_push(message="sketch")
    assert bpy.ops.splash.generate_layers() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="model")
    two = vertices(the_model())
    the_model().splash_model.parts[1].show = False
    bpy.ops.ed.undo_push(message="eye")
    one = vertices(the_model())
    bpy.ops.ed.undo()
    np.testing.assert_array_equal(vertices(the_model()), two)
    bpy.ops.ed.redo()
    np.testing.assert_array_equal(vertices(the_model()), one)
    bpy.data.objects.remove(the_model())
    bpy.context.view_layer.update()
    assert not any(item.hide_viewport for item in splashes())
    bpy.ops.ed.undo_push(message="deleted")
    bpy.ops.ed.undo()
    assert all(item.hide_viewport for item in splashes()), "the model shows them again"
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    assert not splashes() and len(bpy.context.scene.objects) == 1


def test_a_splash_is_in_one_model_only():
    model = generate_layers(crossing())
    with pytest.raises(ValueError, match="remove it there first"):
        model_parts.new_model(bpy.context, [part("A")])
    bend_sketch = add_sketch([bend()])
    bpy.ops.splash.generate(start=BARE)
    other = next(item for item in splashes() if item.splash.sketch == bend_sketch)
    model.select_set(True)
    other.select_set(True)
    assert bpy.ops.splash.combine() == {"FINISHED"}, "a selected model takes the splash"
    assert len(model.splash_model.parts) == 3 and the_model() == model
    assert Vector(bounds(model)[1]).x > 0.9
