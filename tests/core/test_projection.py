# SPDX-License-Identifier: GPL-3.0-or-later
"""Velocity is made divergence-free, and nothing else happens to it."""

import numpy as np
import pytest

from liquid_splash_addon.core.animation.projection import (
    Faces,
    divergence_free,
    lower_faces,
    project_faces,
)
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.level_set import LevelSet

CELLS = 28


def places(axis: int | None = None) -> np.ndarray:
    """Return the centres of cells, or those of their lower faces, in cells from the middle."""
    points = np.stack(np.mgrid[:CELLS, :CELLS, :CELLS], axis=-1) + 0.5 - CELLS / 2
    if axis is not None:
        points[..., axis] -= 0.5
    return points


def ball(radius: float = 9.0, thickness: float | None = None) -> np.ndarray:
    """Return the level of a ball, or of a shell."""
    away = np.linalg.norm(places(), axis=-1) - radius
    level = away if thickness is None else np.abs(away) - thickness / 2
    return level.astype(np.float32)


def on_faces(flow) -> np.ndarray:
    """Return a flow, a function of points, on the lower faces ``(3, X, Y, Z)``."""
    return np.stack([flow(places(axis))[..., axis] for axis in range(3)]).astype(np.float32)


FLOWS = {
    "source": lambda p: p,
    "crown": lambda p: p / (np.linalg.norm(p, axis=-1, keepdims=True) + 3) + (0, 0, 1),
    "bend": lambda p: p[..., [1, 2, 0]] ** 2 / 10 + p * p / 10,
}


@pytest.mark.parametrize("thickness", [None, 3.0], ids=["thick", "thin"])
@pytest.mark.parametrize("flow", FLOWS.values(), ids=FLOWS)
def test_divergence_falls_a_hundred_times_and_energy_does_not_grow(flow, thickness):
    level, faces = ball(thickness=thickness), on_faces(flow)
    free, removed = project_faces(level, faces)
    before, after = Faces(level, faces), Faces(level, free)
    assert np.linalg.norm(after.divergence) < np.linalg.norm(before.divergence) / 100
    touching = before.cells.neighbours[:, [0, 2, 4]]
    liquid = before.cells.liquid
    counted = (np.arange(len(touching)) < liquid)[:, None] | ((touching >= 0) & (touching < liquid))
    assert (after.velocity[counted] ** 2).sum() <= (before.velocity[counted] ** 2).sum()
    assert 0 < removed <= 1
    assert project_faces(level, free)[1] < 0.02


def test_free_flows_stay():
    flow = lambda p: np.stack([-p[..., 1], p[..., 0], 0 * p[..., 0] + 3], axis=-1)  # noqa: E731
    free, removed = project_faces(ball(), on_faces(flow))
    assert removed < 1e-4
    wet = ball() < 0
    np.testing.assert_allclose(free[:, wet], on_faces(flow)[:, wet], atol=1e-3)


def test_a_wall_stops_what_runs_into_it():
    class Floor:
        def distance(self, points):
            return points[:, 2] - CELLS / 2

        def velocity(self, points):
            return np.zeros_like(points)

    faces = np.zeros((3, CELLS, CELLS, CELLS), np.float32)
    faces[2] = -1
    level = np.maximum(ball(), CELLS / 2 - np.mgrid[:CELLS, :CELLS, :CELLS][2] - 0.5)
    free, _ = project_faces(level, faces, Floor())
    middle = CELLS // 2
    assert free[2, middle, middle, middle + 1] > -0.2, "just above the floor"
    assert free[0, middle + 6, middle, middle + 1] > 0.05, "it flows outward"


def test_at_the_centres_only_the_change_counts():
    grid = Grid((CELLS,) * 3, 0.003, (0.0, 0.0, 0.0))
    level = ball()
    points = np.moveaxis(places(), -1, 0)
    turning = np.stack([-points[1], points[0], np.sin(points[0])]).astype(np.float32)
    kept = divergence_free(LevelSet(level, turning, grid))
    wet = level < -2
    np.testing.assert_allclose(kept.velocity[:, wet], turning[:, wet], atol=0.02)
    spreading = LevelSet(level, (turning + points).astype(np.float32), grid)
    freed = divergence_free(spreading)
    before = Faces(level, lower_faces(spreading.velocity)).divergence
    after = Faces(level, lower_faces(freed.velocity)).divergence
    assert np.linalg.norm(after) < np.linalg.norm(before) / 5
    assert not divergence_free(LevelSet(level + 99, turning, grid)).box
