# SPDX-License-Identifier: GPL-3.0-or-later
"""The time step with a solid that is known by its distance alone."""

import numpy as np
import pytest

from liquid_splash_addon.core.fluid.collision import COLLISION_SKIN, collide, open_share
from liquid_splash_addon.core.fluid.particles import Particles
from liquid_splash_addon.core.fluid.step import Liquid, World, advance


class Floor:
    """All that lies below a height, at rest."""

    def __init__(self, height: float) -> None:
        self.height = height

    def distance(self, points: np.ndarray) -> np.ndarray:
        return np.asarray(points[:, 2] - self.height, dtype=float)

    def velocity(self, points: np.ndarray) -> np.ndarray:
        return np.zeros(points.shape)


def test_faces_are_open_as_far_as_they_rise_above_a_floor():
    cells = np.array([[5, 5, 8], [5, 5, 10], [5, 5, 11], [5, 5, 12]])
    share = open_share(cells, Floor(10.3))
    assert share.dtype == np.float32
    assert share[:, 2].tolist() == [0, 0, 1, 1]  # horizontal faces at z = 8, 10, 11, 12
    # Of the four rows of samples of an upright face, three lie above 10.3.
    assert share[:, 0].tolist() == share[:, 1].tolist() == [0, 0.75, 1, 1]


def test_more_cells_than_are_sampled_at_a_time_get_their_own_shares():
    cells = np.stack(np.meshgrid(*[np.arange(30)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    share = open_share(cells, Floor(14.3)).reshape(30, 30, 30, 3)
    assert (share == share[:1, :1]).all()
    assert share[0, 0, 13:17, 0].tolist() == [0, 0.75, 1, 1]


def test_a_floor_stops_what_moves_into_it_and_nothing_else():
    positions = np.array([[5.0, 5, 9.5], [5, 5, 9.5], [5, 5, 12]], dtype=np.float32)
    velocities = np.array([[3.0, 0, -7], [0, 0, 4], [0, 0, -7]], dtype=np.float32)
    collide(positions, velocities, Floor(10.0))
    assert positions[:, 2] == pytest.approx([10 + COLLISION_SKIN] * 2 + [12], abs=1e-5)
    assert velocities == pytest.approx(np.array([[3, 0, 0], [0, 0, 4], [0, 0, -7]]), abs=1e-5)


def test_a_blob_spreads_on_a_floor():
    axes = [np.arange(low + 0.25, high, 0.5) for low, high in ((28, 36), (28, 36), (24, 32))]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    blob = Liquid.at_start(Particles.moving(points, np.array([0, 0, -100.0]), 1 / 8))
    world = World(64, 800.0, 0.0, Floor(22.0))
    later = advance(blob, world, 0.1)
    assert later.left == pytest.approx(0, abs=1e-3 * blob.emitted)
    heights = later.particles.positions[:, 2]
    assert heights.min() > 22 - COLLISION_SKIN
    assert np.median(heights) < 25 and np.ptp(later.particles.positions[:, 0]) > 12
