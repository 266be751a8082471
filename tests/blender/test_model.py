# SPDX-License-Identifier: GPL-3.0-or-later
"""Splashes become one model: closed, symmetric, live, outside its obstacles."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from liquid_splash_addon.blender.jobs import compose
from tests.blender.modelling import (
    bodies,
    bounds,
    crossing,
    edges_twice,
    generate_layers,
    layered,
    part,
    single,
    union_volume,
    volume,
)
from tests.blender.sketching import fan, in_world, real_velocities, splashes, vertices

pytestmark = [pytest.mark.once, pytest.mark.usefixtures("thick_drafts")]


def test_each_layer_is_a_splash_and_together_they_are_one_closed_mesh():
    sketch = crossing()
    model = generate_layers(sketch)
    assert [item.splash.layer for item in splashes()] == ["A", "B"]
    assert [item.name for item in model.splash_model.parts] == ["Splash A", "Splash B"]
    assert bpy.context.active_object == model
    assert all(item.hide_viewport and item.hide_render for item in splashes())
    model.splash_model.settings.blend = 0.0
    assert edges_twice(model)
    union = union_volume(splashes())
    assert union < 0.97 * sum(map(volume, splashes())), "the splashes cross"
    assert volume(model) == pytest.approx(union, rel=0.03)
    speed = np.linalg.norm(real_velocities(model), axis=1)
    assert speed.min() > 0.1
    assert model.data.materials[0] == splashes()[0].data.materials[0]


def test_a_splash_joined_with_itself_stays_itself():
    sketch = layered(fan(), fan())
    model = generate_layers(sketch)
    model.splash_model.settings.blend = 0.0
    assert volume(model) == pytest.approx(volume(part("A")), rel=0.02)
    low, high = bounds(part("A")), bounds(model)
    np.testing.assert_allclose(high, low, atol=0.01)


def test_mirrors_and_copies_are_symmetric():
    model = single(Matrix.Translation((3, 1, 2)) @ Matrix.Rotation(0.7, 4, "Y"))
    settings = model.splash_model.settings
    plain = volume(model)
    assert bounds(model)[0, 0] > -0.3
    settings.mirror_x = True
    low, high = bounds(model)
    assert low[0] == pytest.approx(-high[0], abs=1e-3)
    assert edges_twice(model)
    assert 1.5 * plain < volume(model) < 2.05 * plain, "and not inside out"
    settings.mirror_x = False
    settings.count = 4
    low, high = bounds(model)
    np.testing.assert_allclose([low[:2], high[:2]], [[-high[0]] * 2, [high[0]] * 2], atol=0.01)
    assert 2.5 * plain < volume(model) < 4.05 * plain
    settings.count = 1
    assert volume(model) == pytest.approx(plain)


def test_an_eye_leaves_a_splash_out_and_no_splash_at_all_is_said():
    model = generate_layers(crossing())
    both = vertices(model)
    parts = model.splash_model.parts
    parts[1].show = False
    assert volume(model) == pytest.approx(volume(part("A")), rel=0.02)
    alone = vertices(model)
    parts[0].show = False
    assert "unhide" in model.splash_model.warnings
    np.testing.assert_array_equal(vertices(model), alone)
    parts[0].show = True
    assert not model.splash_model.warnings
    parts[1].show = True
    np.testing.assert_array_equal(vertices(model), both)


def test_refinements_of_a_part_and_waves_of_the_model_are_live():
    model = generate_layers(crossing())
    plain = vertices(model)
    group = model.splash_model
    group.active = 1
    bpy.context.view_layer.objects.active = model
    assert bpy.ops.splash.refinement_add(kind="RUPTURES") == {"FINISHED"}, "of the active part"
    assert len(part("B").splash_stack.items) == 1
    refined = vertices(model)
    assert refined.shape != plain.shape
    assert bpy.ops.splash.refinement_add(kind="WAVES") == {"FINISHED"}
    np.testing.assert_array_equal(vertices(model), refined, "waves of a part do not count")
    group.use_waves = True
    waves = vertices(model)
    assert waves.shape != refined.shape
    group.waves.amplitude = 0.003
    assert vertices(model).shape == waves.shape
    moved = np.linalg.norm(vertices(model) - waves, axis=1)
    assert 1e-4 < moved.max() < 0.003 / 0.32 * 3, "metres at real size"
    group.use_waves = False
    np.testing.assert_array_equal(vertices(model), refined)
    assert bpy.ops.splash.refinement_apply() == {"FINISHED"}
    assert bpy.ops.splash.model_update() == {"FINISHED"}
    # Its mesh is taken as it is from then on, with the waves of its own.
    assert volume(model) == pytest.approx(union_volume(splashes()), rel=0.05)


def test_sheets_are_those_of_the_model():
    model = generate_layers(crossing())
    group = model.splash_model
    bpy.context.view_layer.objects.active = model
    plain = vertices(model)
    assert bpy.ops.splash.refinement_add(kind="SHEETS") == {"FINISHED"}
    np.testing.assert_array_equal(vertices(model), plain, "sheets of a part do not count")
    group.use_sheets = True
    sheets = vertices(model)
    assert sheets.shape != plain.shape
    group.use_waves = True
    assert vertices(model).shape != plain.shape
    group.use_waves = False
    np.testing.assert_array_equal(vertices(model), sheets)
    group.use_sheets = False
    np.testing.assert_array_equal(vertices(model), plain)


def test_drops_are_in_the_model_once():
    model = generate_layers(layered(fan(), fan()))
    for name in "AB":
        model.splash_model.active = "AB".index(name)
        bpy.context.view_layer.objects.active = model
        bpy.ops.splash.refinement_add(kind="DROPLETS")
        part(name).splash_stack.items[0].droplets.amount = 0.05
        part(name).splash_stack.items[0].droplets.flight = 0.05
    # More than specks of a cell or two, which the joint loses.
    pieces = len(bodies(model, 24))
    assert pieces > 3, "there are drops"
    assert pieces == pytest.approx(len(bodies(part("A"), 24)), abs=1)
    assert edges_twice(model)


def test_a_slider_of_the_model_does_not_redo_its_splashes(monkeypatch):
    model = generate_layers(crossing())

    def forbidden(*_):
        raise AssertionError("a splash was refined again")

    monkeypatch.setattr(compose, "refine_part", forbidden)
    before = vertices(model)
    model.splash_model.settings.blend = 6.0
    assert volume(model) > 0 and vertices(model).shape != before.shape


def ball(place=(0.5, 0.0, 0.0), radius=0.25) -> bpy.types.Collection:
    """Return a collection that holds a ball."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, location=place, segments=48, ring_count=24)
    collection = bpy.data.collections.new("Obstacles")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(bpy.context.active_object)
    return collection


def test_liquid_stays_outside_its_obstacles():
    model = generate_layers(crossing())
    plain = vertices(model)
    assert np.linalg.norm(in_world(model) - (0.5, 0, 0), axis=1).min() < 0.15
    collection = ball()
    model.splash_model.use_waves = True
    model.splash_obstacles.collection = collection
    assert np.linalg.norm(in_world(model) - (0.5, 0, 0), axis=1).min() > 0.245
    model.splash_model.use_waves = False
    carved = vertices(model)
    collection.objects[0].scale = (20, 20, 20)
    bpy.context.view_layer.objects.active = model
    assert bpy.ops.splash.model_update() == {"FINISHED"}
    assert "swallow" in model.splash_model.warnings
    np.testing.assert_array_equal(vertices(model), carved)
    model.splash_obstacles.collection = None
    np.testing.assert_array_equal(vertices(model), plain)
