# SPDX-License-Identifier: GPL-3.0-or-later
"""Sketches of simulated liquid: of our splashes, of Mantaflow's, of particles."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from scipy.spatial import cKDTree

from liquid_splash_addon.blender.scene.flow import read_flow
from liquid_splash_addon.blender.scene.stroke_objects import read_sketch
from liquid_splash_addon.core.refinement.presets import BARE
from tests.blender.flowing import LENGTH, baked, ball, exported, uniform
from tests.blender.manta_module import mend
from tests.blender.sketching import add_sketch, fan, generate

GAIN = 4.0


def sketched(item: bpy.types.Object, **settings) -> list:
    """Press the button and return the drawings of the sketch, in the world."""
    bpy.context.view_layer.objects.active = item
    bpy.context.scene.splash.settings.speed_gain = GAIN
    assert bpy.ops.splash.strokes_from_flow(**settings) == {"FINISHED"}
    sketch = bpy.context.active_object
    assert sketch.type == "GREASEPENCIL" and sketch != item
    drawings, warnings = read_sketch((sketch,), to_space=np.eye(4))
    assert not warnings
    return drawings


def speeds_of(drawing) -> np.ndarray:
    """Return how fast it was drawn, by its times alone."""
    return np.linalg.norm(np.diff(drawing.points, axis=0), axis=1) / np.diff(drawing.times)


def along(drawing, velocities: np.ndarray) -> np.ndarray:
    """Return the part of velocities ``(n, 3)`` that goes along the stroke's segments."""
    steps = np.diff(drawing.points, axis=0)
    return (velocities * steps).sum(axis=-1) / np.linalg.norm(steps, axis=1)


@pytest.fixture
def splash(tubes):
    """A splash that is moved, turned and larger than its sketch."""
    add_sketch(fan())
    item = generate()
    item.matrix_world = Matrix.LocRotScale((1, 2, 3), None, (2, 2, 2)) @ item.matrix_world
    bpy.context.view_layer.update()
    return item


def test_a_splash_becomes_a_sketch_of_its_own_speed(splash):
    splash.splash_motion.time_scale = 0.05
    flow = read_flow(bpy.context, splash, 0.05)
    tree, size = cKDTree(flow.points), np.ptp(flow.points, axis=0).max()
    drawings = sketched(splash, strokes=5)
    assert len(drawings) == 5
    errors = []
    for drawing in drawings:
        middles = (drawing.points[1:] + drawing.points[:-1]) / 2
        away, nearest = tree.query(middles)
        assert away.max() < 0.1 * size, "strokes lie in the splash, wherever it stands"
        wanted = along(drawing, flow.velocities[nearest])
        errors.append(speeds_of(drawing) * GAIN / wanted - 1)
    assert np.median(np.abs(np.concatenate(errors))) < 0.1


def test_the_sketch_makes_a_splash_again(splash):
    size = max(splash.dimensions)
    sketched(splash, strokes=6)
    again = bpy.ops.splash.generate(resolution="64", real_size=0.32, start=BARE)
    assert again == {"FINISHED"}
    assert max(bpy.context.active_object.dimensions) == pytest.approx(size, rel=0.2)


def test_particles_become_a_sketch(tubes):
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (4000, 3)) * (1, 0.3, 0.1)
    data = bpy.data.meshes.new("Particles")
    data.vertices.add(len(points))
    data.vertices.foreach_set("co", points.ravel())
    velocity = data.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    velocity.data.foreach_set("vector", np.tile([3.0, 0, 0], len(points)))
    item = bpy.data.objects.new("Particles", data)
    bpy.context.collection.objects.link(item)
    drawings = sketched(item, strokes=4)
    for drawing in drawings:
        assert np.median(speeds_of(drawing)) == pytest.approx(3 / GAIN, rel=0.02)
        assert np.ptp(drawing.points[:, 0]) > 5 * np.ptp(drawing.points[:, 1:], axis=0).max()


def test_mantaflows_own_frames_become_a_sketch(tmp_path):
    mend()
    item = exported(
        ball(uniform), tmp_path, 24, resolution=40, frames=2, gravity=0.0, margin=1.0, mesh=True
    )
    baked(item)
    bpy.ops.fluid.bake_mesh()
    bpy.context.scene.frame_set(item.splash_domain.frame + 1)
    wanted = uniform(np.zeros(3)) / LENGTH
    for drawing in sketched(item, strokes=3, time_scale=1.0):
        course = drawing.points[-1] - drawing.points[0]
        assert course @ wanted > 0.7 * np.linalg.norm(course) * np.linalg.norm(wanted)
        error = speeds_of(drawing) * GAIN / along(drawing, wanted) - 1
        assert np.median(np.abs(error)) < 0.05


def test_what_does_not_flow_says_so(tubes):
    bpy.ops.mesh.primitive_cube_add()
    with pytest.raises(RuntimeError, match="has no attribute 'velocity'"):
        bpy.ops.splash.strokes_from_flow()
    data = bpy.context.active_object.data
    data.attributes.new("velocity", "FLOAT_VECTOR", "CORNER")
    with pytest.raises(RuntimeError, match="has no attribute 'velocity'"):
        bpy.ops.splash.strokes_from_flow()
    data.attributes.remove(data.attributes["velocity"])
    data.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    with pytest.raises(RuntimeError, match="velocities are zero"):
        bpy.ops.splash.strokes_from_flow()
    assert len(bpy.context.scene.objects) == 1, "nothing was made"
