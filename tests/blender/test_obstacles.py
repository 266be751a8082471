# SPDX-License-Identifier: GPL-3.0-or-later
"""Obstacles: liquid is never inside them, wherever splash and obstacles stand."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from liquid_splash_addon.blender.jobs import loaded_generator
from tests.blender.sketching import TubeGenerator, add_sketch, fan, generate, in_world, vertices

pytestmark = pytest.mark.usefixtures("tubes")


def ball(place=(0.6, 0.0, 0.0), radius=0.3) -> bpy.types.Collection:
    """Return a collection that holds a ball."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, location=place, segments=64, ring_count=32)
    item = bpy.context.active_object
    collection = bpy.data.collections.new("Obstacles")
    bpy.context.scene.collection.children.link(collection)
    for home in list(item.users_collection):
        home.objects.unlink(item)
    collection.objects.link(item)
    return collection


def closest(splash: bpy.types.Object, place=(0.6, 0.0, 0.0)) -> float:
    """Return the distance of the nearest vertex to a place in the world."""
    return float(np.linalg.norm(in_world(splash) - place, axis=1).min())


@pytest.mark.parametrize(
    "matrix", [Matrix(), Matrix.Translation((2, 1, 3)) @ Matrix.Rotation(1, 4, "X")]
)
def test_liquid_stays_outside(matrix):
    add_sketch(fan(), matrix)
    splash = generate()
    place = tuple(matrix @ Matrix.Translation((0.6, 0, 0)).translation)
    collection = ball(place)
    bpy.context.view_layer.objects.active = splash
    before = closest(splash, place)
    splash.splash_obstacles.collection = collection
    cell = 2 * 0.003125 / 0.32  # of the draft, in Blender units: the sketch is about one unit wide
    assert before < 0.2
    assert closest(splash, place) > 0.3 - 0.1 * cell - 0.002  # a ball of 64 segments is a bit flat
    assert closest(splash, place) < 0.3 + 2 * cell, "and reaches it"


def test_clearance_keeps_it_farther_and_clearing_gives_it_back():
    add_sketch(fan())
    splash = generate()
    plain = vertices(splash)
    splash.splash_obstacles.collection = ball()
    near = closest(splash)
    splash.splash_obstacles.clearance = 3.0
    assert closest(splash) > near + 0.02
    splash.splash_obstacles.collection = None
    np.testing.assert_array_equal(vertices(splash), plain)


def test_a_moved_obstacle_is_followed_on_update_and_regenerate():
    add_sketch(fan())
    splash = generate()
    collection = ball()
    splash.splash_obstacles.collection = collection
    collection.objects[0].location = (0.2, 0.0, 0.0)
    bpy.context.view_layer.objects.active = splash
    assert bpy.ops.splash.refinement_update() == {"FINISHED"}
    assert closest(splash, (0.2, 0, 0)) > 0.29
    carved = vertices(splash)
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(splash), carved)


def test_the_generator_sees_the_obstacle(monkeypatch):
    generator = TubeGenerator()
    monkeypatch.setattr(loaded_generator, "get", lambda *_: generator)
    add_sketch(fan())
    splash = generate()
    assert generator.obstacle is None
    splash.splash_obstacles.collection = ball()
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.regenerate()
    assert generator.obstacle.shape == (64, 64, 64)
    assert generator.obstacle.min() < 0 < generator.obstacle.max()


def test_swallowing_obstacle_is_reported_and_the_mesh_stays():
    add_sketch(fan())
    splash = generate()
    plain = vertices(splash)
    splash.splash_obstacles.collection = ball(radius=5.0)
    assert "swallow the whole splash" in splash.splash_stack.warnings
    np.testing.assert_array_equal(vertices(splash), plain)
    bpy.context.view_layer.objects.active = splash
    with pytest.raises(RuntimeError, match="swallow the whole splash"):
        bpy.ops.splash.regenerate()
    np.testing.assert_array_equal(vertices(splash), plain)


def test_open_obstacles_are_sheets_with_a_warning():
    add_sketch(fan())
    splash = generate()
    bpy.ops.mesh.primitive_plane_add(size=2, location=(0.6, 0, 0), rotation=(0, np.pi / 2, 0))
    plane = bpy.context.active_object
    collection = bpy.data.collections.new("Walls")
    collection.objects.link(plane)
    bpy.context.scene.collection.children.link(collection)
    splash.splash_obstacles.collection = collection
    assert "not closed" in splash.splash_stack.warnings
    assert np.abs(in_world(splash)[:, 0] - 0.6).min() > 0.01


def test_hidden_obstacles_do_not_count():
    add_sketch(fan())
    splash = generate()
    plain = vertices(splash)
    collection = ball()
    collection.objects[0].hide_set(True)
    splash.splash_obstacles.collection = collection
    np.testing.assert_array_equal(vertices(splash), plain)
