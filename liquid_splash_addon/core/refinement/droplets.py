# SPDX-License-Identifier: GPL-3.0-or-later
"""Droplets that break off a splash (paper, 5.1)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..liquid.fields import AIR
from ..liquid.level_set import LevelSet
from .blue_noise import balls_around
from .detail import Detail
from .drop_meshes import drop_cloud, drop_radii
from .front import band_cells, break_measure, choose
from .particle_level import FineLevel
from .pbf import PbfParticles, simulate
from .settings import (
    LARGE_DROP_PARTICLES,
    LARGEST_RADIUS,
    PARTICLE_STEP,
    SMALL_DROP_PARTICLES,
    SMALLEST_RADIUS,
    DropletSettings,
)

MERGE_DISTANCE = 1.0
"""A drop merges with the splash if it is within this many cells of it."""

SPEED_SPREAD = 0.25
"""Relative spread of the speeds at which drops leave: with one speed they would line up."""

SAMPLE_DISTANCE = 2.0
"""Size of the strata in which sample points are drawn, in mean drop radii."""


def add_droplets(liquid: LevelSet, settings: DropletSettings) -> Detail:
    """Return the splash with droplets near its fronts.

    Points are chosen by eq. 4. Around each a ball of blue-noise particles is made, moved by
    position-based fluids with cohesion, and turned into a signed distance. Drops that meet the
    splash are merged with it, the others fly free.
    """
    rng = np.random.default_rng(settings.seed)
    points = sample_points(liquid, settings, rng)
    if not len(points):
        return Detail(liquid)
    particles, warnings = make_particles(liquid, points, settings, rng)
    if not len(particles.spacing):
        return Detail(liquid, warnings=warnings)
    steps = max(round(settings.flight / PARTICLE_STEP), 1)
    particles = simulate(particles, steps, settings.flight / steps, settings.cohesion)
    fine = FineLevel.of(particles)
    label = fine.components()
    large = np.append(drop_radii(fine, label) >= SMALLEST_RADIUS, False)
    merged = merging(liquid, fine, label, large)
    # Drops too small for the grid would be specks of one cell: in the splash they are left out.
    wet = with_drops(liquid, fine, (label < 0) | (merged & large)[label])
    cloud = drop_cloud(fine, label, merged, liquid.grid, settings.cohesion)
    gained = wet.volume - liquid.volume + cloud.volume / liquid.grid.spacing**3
    return Detail(wet, gained, warnings, cloud)


def sample_points(
    liquid: LevelSet, settings: DropletSettings, rng: np.random.Generator
) -> np.ndarray:
    """Return the points ``(n, 3)``, cells, around which drops are made."""
    cells = band_cells(liquid, inside=True)
    if not len(cells) or settings.amount == 0:
        return np.zeros((0, 3), dtype=np.float32)
    measure = break_measure(liquid, cells, settings.turbulence, settings.curvature)
    apart = SAMPLE_DISTANCE * max(settings.size, SMALLEST_RADIUS)
    return choose(cells, measure, settings.amount, apart, rng)


def make_particles(
    liquid: LevelSet, points: np.ndarray, settings: DropletSettings, rng: np.random.Generator
) -> tuple[PbfParticles, list[str]]:
    """Return the particles around ``points``, as many as the settings allow, and warnings."""
    radii = settings.size * np.exp(settings.spread * rng.normal(size=len(points)))
    radii = np.clip(radii, 0.3 * settings.size, LARGEST_RADIUS)
    share = np.clip((radii - SMALLEST_RADIUS) / (LARGEST_RADIUS - SMALLEST_RADIUS), 0, 1)
    counts = np.round(
        SMALL_DROP_PARTICLES + (LARGE_DROP_PARTICLES - SMALL_DROP_PARTICLES) * share
    ).astype(int)
    fitting = int(np.searchsorted(counts.cumsum(), settings.particles, side="right"))
    warnings = []
    if fitting < len(points):
        warnings.append(
            f"Droplets: only {fitting} of {len(points)} drops, as the limit is "
            f"{settings.particles:,} particles (lower Amount or raise Most Particles)"
        )
    positions, spacing, group = balls_around(
        points[:fitting], radii[:fitting], counts[:fitting], rng
    )
    pace = 1 + SPEED_SPREAD * np.clip(rng.normal(size=fitting), -2, 2)
    velocities = liquid.flow_at(positions, points[group]) * pace[group, None]
    return PbfParticles(positions, velocities.astype(np.float32), spacing, group), warnings


def merging(liquid: LevelSet, fine: FineLevel, label: np.ndarray, large: np.ndarray) -> np.ndarray:
    """Return which drops merge with the splash, bool ``(drops + 1,)``; the last is for label -1.

    large : bool ``(drops + 1,)``, drops that merge if they are near; the others must touch it.
    """
    cells = (fine.cells.coordinates + fine.start) // 2
    shape = liquid.level.shape
    inside = ((cells >= 0) & (cells < shape)).all(axis=1)
    level = np.full(len(label), AIR, dtype=np.float32)
    level[inside] = liquid.distance[tuple(cells[inside].T)]
    meets = np.zeros(label.max() + 2, dtype=bool)
    near = level < np.where(large, MERGE_DISTANCE, 0.0)[label]
    meets[label[near & (label >= 0)]] = True
    return meets


def with_drops(liquid: LevelSet, fine: FineLevel, drawn: np.ndarray) -> LevelSet:
    """Return the union of the splash and the fine cells chosen by ``drawn``, bool ``(n,)``."""
    shape = liquid.grid.shape
    numbers, level, velocity = fine.coarse(shape, drawn)
    out = liquid.level.copy()
    flow = liquid.velocity.copy()
    nearer = level < np.minimum(out.ravel()[numbers], AIR)
    numbers = numbers[nearer]
    out.ravel()[numbers] = level[nearer]
    flow.reshape(3, -1)[:, numbers] = velocity[nearer].T * liquid.grid.spacing
    return replace(liquid, level=out, velocity=flow)
