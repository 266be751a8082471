# SPDX-License-Identifier: GPL-3.0-or-later
"""Particles of droplets: how they are placed, how they move, what surface they have."""

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.refinement.blue_noise import (
    LEAST_GAP,
    ball,
    balls_around,
    random_turn,
)
from liquid_splash_addon.core.refinement.drop_meshes import drop_cloud
from liquid_splash_addon.core.refinement.pairs import SLACK, SUPPORT, find_pairs
from liquid_splash_addon.core.refinement.particle_level import FineLevel
from liquid_splash_addon.core.refinement.pbf import PbfParticles, densities, simulate

DT = 1 / 240


def drop(radius=1.5, count=200, centre=(20.0, 20.0, 20.0), stretch=(1, 1, 1)) -> PbfParticles:
    """Return the particles of one drop, cells."""
    positions = ball(count, 0) * radius * np.asarray(stretch) + np.asarray(centre)
    spacing = np.full(count, radius * (4 / 3 * np.pi / count) ** (1 / 3))
    return PbfParticles(
        positions.astype(np.float32),
        np.zeros((count, 3), dtype=np.float32),
        spacing.astype(np.float32),
        np.zeros(count, dtype=np.int32),
    )


def both(first: PbfParticles, second: PbfParticles) -> PbfParticles:
    return PbfParticles(*(np.concatenate(arrays) for arrays in zip(first, second, strict=True)))


def momentum(drops: PbfParticles) -> np.ndarray:
    return (drops.spacing[:, None] ** 3 * drops.velocities).sum(axis=0)


@pytest.mark.parametrize("count", [100, 231, 400])
def test_blue_noise_fills_the_ball_and_keeps_apart(count):
    points = ball(count, 3)
    assert np.linalg.norm(points, axis=1).max() <= 1
    spacing = (4 / 3 * np.pi / count) ** (1 / 3)
    assert pdist(points).min() > 0.8 * LEAST_GAP * spacing
    assert np.abs(points.mean(axis=0)).max() < 0.06
    # As many in the inner half of the volume as in the outer.
    inner = (np.linalg.norm(points, axis=1) < 0.5 ** (1 / 3)).mean()
    assert inner == pytest.approx(0.5, abs=0.12)
    assert not np.array_equal(points, ball(count, 4))


def test_turns_are_rotations():
    turn = random_turn(np.random.default_rng(0))
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-6)
    assert np.linalg.det(turn) == pytest.approx(1.0, abs=1e-6)


def test_balls_around_points_have_their_size_and_volume():
    points = np.array([[5.0, 6.0, 7.0], [1.0, 0.0, 0.0]], dtype=np.float32)
    radii, counts = np.array([1.0, 2.5]), np.array([100, 300])
    positions, spacing, group = balls_around(points, radii, counts, np.random.default_rng(2))
    np.testing.assert_array_equal(np.bincount(group), counts)
    away = np.linalg.norm(positions - points[group], axis=1)
    assert (away <= 1.001 * radii[group]).all()
    volume = np.bincount(group, spacing.astype(np.float64) ** 3)
    np.testing.assert_allclose(volume, 4 / 3 * np.pi * radii**3, rtol=1e-5)
    assert not len(balls_around(points[:0], radii[:0], counts[:0], np.random.default_rng(2))[0])


def test_pairs_are_all_those_within_reach_once_each():
    rng = np.random.default_rng(1)
    positions = rng.uniform(0, 5, (300, 3)).astype(np.float32)
    spacing = rng.uniform(0.2, 0.6, 300).astype(np.float32)
    first, second = find_pairs(positions, spacing)
    found = set(zip(first.tolist(), second.tolist(), strict=True))
    assert len(found) == len(first)
    gap = np.linalg.norm(positions[:, None] - positions[None], axis=2)
    reach = 0.5 * SUPPORT * SLACK * (spacing[:, None] + spacing[None])
    wanted = {(i, j) for i, j in np.argwhere(gap < reach).tolist() if i < j}
    assert found == wanted


def test_liquid_resists_compression():
    squeezed = drop(radius=2.0, count=400, stretch=(0.8, 0.8, 0.8))
    before = densities(squeezed.positions, squeezed.spacing)
    after = simulate(squeezed, 12, DT, 0.5)
    density = densities(after.positions, after.spacing)
    depth = np.linalg.norm(after.positions - after.positions.mean(axis=0), axis=1)
    inner = depth < np.quantile(depth, 0.5)
    assert np.maximum(before[inner] - 1, 0).mean() > 0.3, "the test squeezes"
    assert np.maximum(density[inner] - 1, 0).mean() < 0.05


def test_cohesion_rounds_a_free_drop():
    long = drop(radius=1.5, count=250, stretch=(1.4, 0.85, 0.84))

    def unevenness(drops: PbfParticles) -> float:
        """Spread of the surface's distance from its middle, over the mean distance."""
        fine = FineLevel.of(drops)
        label = fine.components()
        free = np.zeros(label.max() + 2, dtype=bool)
        mesh = drop_cloud(fine, label, free, Grid((40,) * 3, 1.0, (0.0,) * 3), cohesion=0.0).mesh
        radius = np.linalg.norm(mesh.vertices - mesh.vertices.mean(axis=0), axis=1)
        return float(radius.std() / radius.mean())

    settled = simulate(long, 120, DT, 1.0)
    assert unevenness(long) > 0.13
    assert unevenness(settled) < 0.1
    loose = simulate(long, 120, DT, 0.0)
    assert unevenness(loose) > 2 * unevenness(settled), "it is cohesion that does it"


def test_momentum_is_kept():
    moving = both(drop(centre=(20, 20, 20)), drop(radius=1.0, count=120, centre=(22.2, 20.5, 20)))
    velocities = moving.velocities.copy()
    velocities[200:] = (-60.0, 10.0, 0.0)
    moving = moving._replace(velocities=velocities)
    after = simulate(moving, 8, DT, 0.7)
    np.testing.assert_allclose(momentum(after), momentum(moving), rtol=0.03, atol=3.0)


@pytest.mark.parametrize("cohesion", [0.0, 1.0])
def test_nothing_blows_up(cohesion):
    heap = both(drop(), drop(radius=3.0, count=400))  # two drops in one place
    after = simulate(heap, 60, DT, cohesion)
    assert np.isfinite(after.positions).all()
    assert np.linalg.norm(after.velocities, axis=1).max() < 200
    assert np.abs(after.positions - 20).max() < 15


@pytest.mark.parametrize(("radius", "count"), [(0.75, 100), (1.5, 200), (3.0, 400)])
def test_the_surface_has_the_volume_that_the_particles_stand_for(radius, count):
    fine = FineLevel.of(simulate(drop(radius, count), 4, DT, 0.5))
    volume = np.clip(0.5 - fine.level, 0, 1).sum() / 8
    assert volume == pytest.approx(4 / 3 * np.pi * radius**3, rel=0.2)
    assert fine.components().max() == 0, "one drop"


def test_drops_apart_are_counted_apart():
    fine = FineLevel.of(both(drop(centre=(10, 10, 10)), drop(centre=(20, 10, 10))))
    label = fine.components()
    assert label.max() == 1
    left = (fine.cells.coordinates[:, 0] + fine.start[0]) / 2 < 15
    assert len(np.unique(label[left & (label >= 0)])) == 1
    assert len(np.unique(label[~left & (label >= 0)])) == 1
