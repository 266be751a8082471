# SPDX-License-Identifier: GPL-3.0-or-later
"""What solvers start from is the splash or model that is seen, in metres, and where it stands."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector
from scipy.ndimage import map_coordinates

from liquid_splash_addon.blender.data.frame_text import frame_from_text
from liquid_splash_addon.blender.jobs.solver_start import compute_start, read_start
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.progress import silent
from tests.blender.modelling import crossing, generate_layers
from tests.blender.sketching import SIZE, add_sketch, fan, generate, in_world, vertices

pytestmark = pytest.mark.usefixtures("thick_drafts")

PLACE = Matrix.LocRotScale(Vector((-4, 2, 1)), Euler((2.9, 0.2, 0.8)), (1.5, 1.5, 1.5))


def start_of(item):
    """Return the start of a splash or model."""
    return compute_start(read_start(item), silent)


def sampled(start, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return distance (cells) and velocity (units/s, world) of the start at points of the world."""
    liquid, frame = start.liquid, start.world
    cells = (liquid.grid.to_cells(frame.points_to_local(points)) - 0.5).T
    distance = map_coordinates(liquid.distance, cells, order=1, mode="nearest")
    velocity = [map_coordinates(v, cells, order=1, mode="nearest") for v in liquid.velocity]
    return distance, frame.vectors_to_drawing(np.stack(velocity, axis=1))


def check_seen(start, item) -> None:
    """Check that the surface and velocity of ``item`` are those of the start."""
    points = in_world(item)[::7]
    distance, velocity = sampled(start, points)
    assert np.abs(distance).mean() < 0.25
    expected = vertices(item, "velocity")[::7] @ np.array(item.matrix_world)[:3, :3].T
    error = np.linalg.norm(velocity - expected, axis=1)
    assert np.median(error) < 0.05 * np.median(np.linalg.norm(expected, axis=1))


def test_a_splash_and_where_it_stands():
    add_sketch(fan())
    splash = generate()
    splash.matrix_world = PLACE
    start = start_of(splash)
    assert np.ptp(start.frame.points_to_local(vertices(splash)), axis=0).max() > 0.8 * SIZE
    check_seen(start, splash)
    length = frame_from_text(splash.splash.frame).scale.length
    assert start.cell == pytest.approx(1.5 * Grid.local(64).spacing / length)
    assert start.world.scale.time == pytest.approx(0.05)


def test_a_model_with_a_mirror():
    model = generate_layers(crossing())
    model.splash_model.settings.mirror_x = True
    model.matrix_world = PLACE
    start = start_of(model)
    check_seen(start, model)
    waves = start_of(model)
    model.splash_model.use_waves = True
    after = start_of(model)
    np.testing.assert_array_equal(after.liquid.level, waves.liquid.level)


def test_refinements_of_the_liquid_are_in_it_and_waves_are_not():
    add_sketch(fan())
    splash = generate()
    bare = start_of(splash)
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.refinement_add(kind="WAVES")
    assert read_start(splash).key == bare_key(splash)
    np.testing.assert_array_equal(start_of(splash).liquid.level, bare.liquid.level)
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    assert read_start(splash).key != bare_key(splash)
    refined = start_of(splash)
    assert refined.liquid.volume + len(refined.drops.radii) > bare.liquid.volume
    bpy.ops.splash.refinement_apply()
    applied = start_of(splash)
    np.testing.assert_array_equal(applied.liquid.level, refined.liquid.level)
    np.testing.assert_array_equal(applied.drops.positions, refined.drops.positions)


def bare_key(splash) -> str:
    """Return the key that the start would have without refinements."""
    shown = [item.show for item in splash.splash_stack.items]
    for item in splash.splash_stack.items:
        item.show = False
    key = read_start(splash).key
    for item, was in zip(splash.splash_stack.items, shown, strict=True):
        item.show = was
    return key


def test_obstacles_are_carved_out_and_there():
    add_sketch(fan())
    splash = generate()
    whole = start_of(splash).liquid.volume
    collection = bpy.data.collections.new("Obstacles")
    bpy.context.scene.collection.children.link(collection)
    bpy.ops.mesh.primitive_cube_add(size=0.6, location=(0.6, 0, 0))
    cube = bpy.context.object
    collection.objects.link(cube)
    splash.splash_obstacles.collection = collection
    start = start_of(splash)
    assert start.liquid.volume < 0.9 * whole
    (obstacle,) = start.obstacles
    corners = start.world.points_to_drawing(obstacle.triangles.reshape(-1, 3))
    np.testing.assert_allclose(corners.min(axis=0), (0.3, -0.3, -0.3), atol=1e-5)


def test_what_is_no_liquid_says_so():
    bpy.ops.mesh.primitive_cube_add()
    with pytest.raises(ValueError, match="Select a splash"):
        read_start(bpy.context.object)
    add_sketch(fan())
    splash = generate()
    splash.scale = (1, 2, 1)
    with pytest.raises(ValueError, match="stretched"):
        start_of(splash)
