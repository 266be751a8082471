# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that cut through each other are found, and smoothing leaves none."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.mesh import marching_cubes, taubin
from liquid_splash_addon.core.mesh.marching_cubes import level_surface
from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.mesh.self_intersection import crossing_faces, take_back
from tests.core.refinement.level_meshes import mesh_of
from tests.core.refinement.test_remeshing import crossing_faces as crossing_by_pymeshlab
from tests.core.refinement.test_remeshing import is_manifold

CELLS = 24
FLAT = [(0, 0, 0), (4, 0, 0), (0, 4, 0)]

PAIRS = {
    "an edge through it": ([(1, 1, -1), (1, 1, 1), (9, 9, 0)], True),
    "through its own edge": ([(2, -1, -1), (2, 1, -1), (2, 0.5, 3)], True),
    "from a common corner": ([(0, 0, 0), (1, 1, 1), (2, 2, -1)], True),
    "past a common corner": ([(0, 0, 0), (-1, 1, 1), (-1, 1, -1)], False),
    "a common edge": ([(0, 0, 0), (4, 0, 0), (1, 1, 1)], False),
    "beside": ([(3, 3, -1), (3, 3, 1), (9, 9, 0)], False),
    "above": ([(1, 1, 0.1), (2, 1, 3), (1, 2, 3)], False),
}


@pytest.mark.parametrize(("other", "expected"), PAIRS.values(), ids=PAIRS)
@pytest.mark.parametrize("turn", range(3))
def test_two_faces(other, expected, turn):
    corners, numbers = np.unique(np.array([*FLAT, *other], float), axis=0, return_inverse=True)
    faces = numbers.reshape(2, 3)
    for pair in (faces, faces[::-1], np.stack([faces[0], np.roll(faces[1], turn)])):
        assert (crossing_faces(1e-3 * corners - 7, pair) == expected).all()


def test_balls_pushed_into_each_other():
    ball = mesh_of(lambda x, y, z: np.sqrt(x**2 + y**2 + z**2) - 8, 12)
    assert not crossing_faces(ball.vertices, ball.faces).any()
    away = ball.vertices + np.array([0.8, 0.3, 0.1]) * np.ptp(ball.vertices[:, 0])
    both = ball.joined(Mesh(away.astype(np.float32), ball.faces, ball.velocities))
    crossed = crossing_faces(both.vertices, both.faces)
    assert crossed.sum() == crossing_by_pymeshlab(both.vertices, both.faces) > 20
    assert not crossing_faces(both.vertices[:0], both.faces[:0]).any()


def cones() -> np.ndarray:
    """Return the level of two thin cones that meet in a point."""
    axes = np.arange(CELLS) - CELLS / 2 + 0.5
    x, y, z = np.meshgrid(axes, axes, axes, indexing="ij")
    return np.abs(np.hypot(x, y) - 0.35 * np.abs(z)) / np.hypot(1, 0.35) - 0.45


def tangle() -> np.ndarray:
    """Return the level of a thin sheet full of folds and holes."""
    wild = gaussian_filter(np.random.default_rng(0).normal(size=(2 * CELLS,) * 3), 3.0)
    steepness = np.linalg.norm(np.gradient(wild), axis=0)
    return np.abs(wild) / np.maximum(steepness, 0.02 * wild.std()) - 0.4


def meshed(level: np.ndarray) -> Mesh:
    grid = Grid(level.shape, 0.003, (-0.2, 0.1, 0.0))
    return level_surface(level, np.zeros((3, *level.shape), dtype=np.float32), grid)


@pytest.mark.parametrize(("shape", "thin"), [(cones, True), (tangle, True), (tangle, False)])
def test_smoothing_lets_no_faces_cross(shape, thin, monkeypatch):
    if thin:  # cones as thick as their cells keep apart by themselves
        monkeypatch.setattr(marching_cubes, "level_of_volume", lambda level, blurred: 0.0)
    mesh = meshed(shape())
    assert crossing_by_pymeshlab(mesh.vertices, mesh.faces) == 0
    assert is_manifold(mesh.faces)
    monkeypatch.setattr(taubin, "take_back", lambda before, moved, faces: moved)
    plain = meshed(shape())
    crossed = crossing_faces(plain.vertices, plain.faces)
    assert crossed.any(), "without help it does"
    near = np.linalg.norm(
        plain.vertices[:, None] - plain.vertices[plain.faces[crossed][:, 0]], axis=2
    ).min(axis=1)
    far = near > 6 * 0.003
    np.testing.assert_array_equal(mesh.vertices[far], plain.vertices[far], "all else is smooth")
    assert far.mean() > 0.2


def test_what_does_not_cross_is_left_alone():
    ball = mesh_of(lambda x, y, z: np.sqrt(x**2 + y**2 + z**2) - 8, 12)
    moved = 1.1 * ball.vertices
    assert take_back(ball.vertices, moved, ball.faces) is moved
