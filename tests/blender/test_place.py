# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a splash is, and that turning and moving a sketch only turns and moves its splash."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector
from scipy.spatial import cKDTree

from liquid_splash_addon.blender.data.frame_text import frame_from_text
from liquid_splash_addon.core.grid import Grid
from tests.blender.sketching import (
    add_sketch,
    fan,
    generate,
    in_world,
    moved,
    real_velocities,
    vertices,
)

pytestmark = pytest.mark.usefixtures("tubes")

TURNS = {
    "moved": Matrix.Translation((2, -1, 3)),
    "turned": Euler((0.5, 1.1, -2.0)).to_matrix().to_4x4(),
    "both": Matrix.LocRotScale(Vector((-4, 2, 1)), Euler((2.9, 0.2, 0.8)), None),
}


def make(drawings, matrix: Matrix | None = None) -> bpy.types.Object:
    """Return the splash of a new sketch."""
    sketch = add_sketch(drawings, matrix)
    generate()
    return next(o for o in bpy.context.scene.objects if o.splash.sketch == sketch)


def distance_in_cells(points: np.ndarray, others: np.ndarray, splash: bpy.types.Object) -> float:
    """Return the mean distance between two sets of vertices, both ways, in cells of the splash."""
    cell = Grid.local(64).spacing / frame_from_text(splash.splash.frame).scale.length
    there, _ = cKDTree(others).query(points)
    back, _ = cKDTree(points).query(others)
    return max(there.mean(), back.mean()) / cell


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
def test_a_turned_sketch_gives_the_turned_splash(turn):
    plain, turned = make(fan()), make(fan(), turn)
    expected = np.array([turn @ Vector(v) for v in vertices(plain)])
    assert distance_in_cells(in_world(turned), expected, plain) < 0.01
    np.testing.assert_allclose(
        real_velocities(turned)[:100], real_velocities(plain)[:100], atol=1e-3
    )


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
def test_turned_strokes_give_the_turned_splash(turn):
    plain, turned = make(fan()), make(moved(fan(), turn))
    expected = np.array([turn @ Vector(v) for v in vertices(plain)])
    assert distance_in_cells(in_world(turned), expected, plain) < 0.5
    _, nearest = cKDTree(expected).query(vertices(turned))
    velocity = np.array([turn.to_3x3() @ Vector(v) for v in vertices(plain, "velocity")])
    error = np.linalg.norm(vertices(turned, "velocity") - velocity[nearest], axis=1)
    assert np.median(error) < 0.1 * np.median(np.linalg.norm(velocity, axis=1))


def test_a_scaled_sketch_is_a_larger_drawing():
    plain, large = make(fan()), make(fan(), Matrix.Scale(3, 4))
    assert tuple(large.scale) == (1, 1, 1)
    assert distance_in_cells(vertices(large), 3 * vertices(plain), large) < 0.5


def test_the_splash_follows_its_sketch_and_keeps_the_users_offset():
    splash = make(fan())
    splash.matrix_world = Matrix.Translation((0, 0, 5)) @ splash.matrix_world
    splash.splash.sketch.matrix_world = TURNS["both"]
    for _ in range(2):
        bpy.ops.splash.regenerate()
        expected = TURNS["both"] @ Matrix.Translation((0, 0, 5))
        np.testing.assert_allclose(splash.matrix_world, expected, atol=1e-5)


@pytest.mark.parametrize("way", ["child", "both moved"])
def test_a_splash_that_came_along_stays(way):
    bpy.context.scene.splash.follow = False
    splash = make(fan())
    sketch = splash.splash.sketch
    bpy.context.view_layer.update()
    if way == "child":
        splash.parent = sketch
        splash.matrix_parent_inverse = sketch.matrix_world.inverted()
    else:
        splash.matrix_world = TURNS["both"] @ splash.matrix_world
    sketch.matrix_world = TURNS["both"] @ sketch.matrix_world
    for _ in range(2):
        bpy.ops.splash.regenerate()
        np.testing.assert_allclose(splash.matrix_world, TURNS["both"], atol=1e-5)
