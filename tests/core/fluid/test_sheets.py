# SPDX-License-Identifier: GPL-3.0-or-later
"""Splitting and merging preserve volume and momentum and sample sheets evenly."""

import numpy as np
import pytest

from liquid_splash_addon.core.fluid.cells import activate, sort_by_cell
from liquid_splash_addon.core.fluid.density import crowding, volume_share
from liquid_splash_addon.core.fluid.particles import Particles
from liquid_splash_addon.core.fluid.sheets import (
    LEAST_VOLUME,
    PARTICLE_SPACING,
    largest_stretch,
    merge,
    resample_sheets,
    split,
)

BOX = (64, 64, 64)


def sheet(spacing=PARTICLE_SPACING, high=40):
    """Return one layer of particles in the plane z = 32.25, drawn out along x."""
    axis = np.arange(24, high, PARTICLE_SPACING) + 0.25
    x = np.arange(24, high, spacing) + spacing / 2
    points = np.stack(np.meshgrid(x, axis, [32.25], indexing="ij"), axis=-1).reshape(-1, 3)
    return Particles.moving(points, np.array([1.0, 2.0, 3.0]), 1 / 8)


def sorted_by_cell(particles):
    """Return cells, sorted particles and counts."""
    cells = activate(particles.positions, BOX, 2)
    order, counts = sort_by_cell(particles.positions, cells)
    return cells, particles.take(order), counts


def moments(particles):
    """Return volume, volume times position, and momentum, in double precision."""
    v = particles.volumes.astype(float)[:, None]
    return np.concatenate(
        [v.sum(0), (v * particles.positions).sum(0), (v * particles.velocities).sum(0)]
    )


def gaps_along_x(particles):
    """Return the largest distance between neighbours in x over all rows of one y."""
    rows = np.unique(particles.positions[:, 1].round(3))
    same = (np.sort(particles.positions[np.abs(particles.positions[:, 1] - y) < 1e-3, 0])
            for y in rows)  # fmt: skip
    return max(np.diff(row).max() for row in same)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0.6, 0.8, 0), (-0.48, 0.6, 0.64)])
def test_the_largest_stretch_is_found(axis):
    axis = np.array(axis)
    b = np.eye(3) * 0.5 + (3.0**2 - 0.5) * axis[:, None] * axis
    out = np.zeros(3, np.float32)
    assert largest_stretch(b.astype(np.float32), out) == pytest.approx(9, rel=1e-3)
    assert abs(out @ axis) == pytest.approx(3, rel=1e-3)


def test_a_stretched_sheet_is_filled_in_and_keeps_volume_and_momentum():
    """Flow that doubles the sheet's length leaves no gap wider than at the start."""
    cells, particles, counts = sorted_by_cell(sheet())
    rate = np.log(2.2)
    gradient = np.zeros((3, 3), np.float32)
    gradient[0, 0], gradient[2, 2] = rate, -rate
    before = moments(particles)
    steps = 10
    for _ in range(steps):
        affine = np.tile(gradient, (len(particles.positions), 1, 1))
        particles = particles._replace(affine=affine)
        were = particles.positions
        moved = were + ((were - 32) @ gradient.T / steps).astype(np.float32)
        particles = resample_sheets(
            particles._replace(positions=moved), were, cells, counts, 1 / steps
        )
        cells, particles, counts = sorted_by_cell(particles)
    after = moments(particles)
    assert len(particles.positions) > 1.5 * 16 * 2 * 16 * 2
    assert after[0] == pytest.approx(before[0], rel=1e-6)
    assert after[4:] == pytest.approx(before[4:], rel=1e-3)
    assert gaps_along_x(particles) < 2 * PARTICLE_SPACING
    assert particles.volumes.min() >= LEAST_VOLUME


def test_halves_lie_evenly_along_the_axis():
    particle = sheet().take(np.array([0]))
    axes = np.array([[2.0, 0.0, 0.0]], np.float32)
    stretched = particle._replace(stretch=np.diag([4.0, 1, 1]).astype(np.float32)[None])
    two = split(stretched, np.array([0]), axes)
    # Drawn out to twice the spacing: the halves are that spacing apart and no longer stretched.
    assert np.ptp(two.positions[:, 0]) == pytest.approx(PARTICLE_SPACING)
    assert two.volumes.tolist() == [1 / 16, 1 / 16]
    assert np.allclose(two.stretch, np.eye(3), atol=1e-6)


def test_spray_is_left_whole():
    lone = sheet().take(np.array([0]))
    lone = lone._replace(stretch=np.diag([25.0, 1, 1]).astype(np.float32)[None])
    cells, particles, counts = sorted_by_cell(lone)
    after = resample_sheets(particles, particles.positions, cells, counts, 0.0)
    assert len(after.positions) == 1


def test_crowds_of_light_particles_merge_and_keep_volume_and_momentum():
    rng = np.random.default_rng(0)
    points = rng.uniform(30, 32, (400, 3))
    light = Particles.moving(points, np.zeros(3), LEAST_VOLUME)
    light = light._replace(velocities=rng.normal(size=(400, 3)).astype(np.float32))
    _, particles, counts = sorted_by_cell(light)
    before = moments(particles)
    fewer = merge(particles, counts)
    assert 190 <= len(fewer.positions) <= 220
    assert moments(fewer) == pytest.approx(before, rel=1e-4, abs=1e-3)


def test_full_liquid_is_full_and_a_squeezed_one_is_crowded():
    axis = np.arange(24, 40, 0.5) + 0.25
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    for squeeze in (1.0, 0.9):
        squeezed = (points - 32) * [squeeze, 1, 1] + 32
        cells, particles, _ = sorted_by_cell(Particles.moving(squeezed, np.zeros(3), 1 / 8))
        deep = np.abs(cells.coordinates[: cells.liquid] + 0.5 - 32).max(axis=1) < 5
        share = volume_share(particles, cells)[: cells.liquid][deep]
        assert share.mean() == pytest.approx(1 / squeeze, rel=0.03)
        far = np.full(len(cells.coordinates), 9.0)
        open_share = np.ones((len(far), 3), np.float32)
        excess = crowding(particles, cells, far, open_share)[deep]
        assert excess.mean() == pytest.approx((1 / squeeze - 1) / 2, abs=0.02)
