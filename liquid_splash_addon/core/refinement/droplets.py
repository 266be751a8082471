# SPDX-License-Identifier: GPL-3.0-or-later
"""Droplets that a splash throws off (paper, 5.1)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..liquid.fields import AIR
from ..liquid.level_set import LevelSet
from .blue_noise import PATTERNS, ball, random_turn
from .detail import Detail
from .drop_meshes import drop_cloud, drop_radii
from .front import band_cells, break_measure, choose
from .particle_level import FineLevel
from .pbf import Drops, simulate
from .settings import FEWEST, LARGEST, MOST, SMALLEST, STEP, DropletSettings

BESIDE = 1.0
"""A drop merges with the splash if it comes within this many cells of it."""

UNEVEN = 0.25
"""Relative spread of the speeds at which drops leave: without it they would stand in a row."""

ROOM = 2.0
"""Least distance of two sample points, in mean drop radii."""


def add_droplets(liquid: LevelSet, settings: DropletSettings) -> Detail:
    """Return the splash with droplets near its fronts.

    Points are chosen by eq. 4, a ball of blue-noise particles is made around each, moved by
    position-based fluids with cohesion and turned into a signed distance, which is united smoothly
    with the splash's where they meet.
    """
    rng = np.random.default_rng(settings.seed)
    points = sample_points(liquid, settings, rng)
    if not len(points):
        return Detail(liquid)
    drops, warnings = make_particles(liquid, points, settings, rng)
    if not len(drops.spacing):
        return Detail(liquid, warnings=warnings)
    steps = max(round(settings.flight / STEP), 1)
    drops = simulate(drops, steps, settings.flight / steps, settings.cohesion)
    fine = FineLevel.of(drops)
    label = fine.components()
    large = np.append(drop_radii(fine, label) >= SMALLEST, False)
    merged = merging(liquid, fine, label, large)
    # What a grid cannot hold would be specks of one cell on it: inside the splash it is gone.
    wet = smooth_union(liquid, fine, (label < 0) | (merged & large)[label])
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
    apart = ROOM * max(settings.size, SMALLEST)
    return choose(cells, measure, settings.amount, apart, rng)


def make_particles(
    liquid: LevelSet, points: np.ndarray, settings: DropletSettings, rng: np.random.Generator
) -> tuple[Drops, list[str]]:
    """Return the particles around ``points`` and warnings: no more than the settings allow."""
    radii = settings.size * np.exp(settings.spread * rng.normal(size=len(points)))
    radii = np.clip(radii, 0.3 * settings.size, LARGEST)
    share = np.clip((radii - SMALLEST) / (LARGEST - SMALLEST), 0, 1)
    counts = np.round(FEWEST + (MOST - FEWEST) * share).astype(int)
    fitting = int(np.searchsorted(counts.cumsum(), settings.particles, side="right"))
    warnings = []
    if fitting < len(points):
        warnings.append(
            f"Droplets: {fitting} of {len(points)} drops, as {settings.particles:,} particles "
            "are the bound (lower Amount or raise Most Particles)"
        )
    parts = [np.zeros((0, 3))]
    parts += [
        ball(count, int(rng.integers(PATTERNS))) @ random_turn(rng) * radius + point
        for point, radius, count in zip(
            points[:fitting], radii[:fitting], counts[:fitting], strict=True
        )
    ]
    spacing = radii * (4 / 3 * np.pi / counts) ** (1 / 3)
    group = np.repeat(np.arange(fitting, dtype=np.int32), counts[:fitting])
    positions = np.concatenate(parts).astype(np.float32)
    pace = 1 + UNEVEN * np.clip(rng.normal(size=fitting), -2, 2)
    velocities = liquid.flow_at(positions, points[group]) * pace[group, None]
    return Drops(
        positions, velocities.astype(np.float32), spacing[group].astype(np.float32), group
    ), warnings


def merging(liquid: LevelSet, fine: FineLevel, label: np.ndarray, large: np.ndarray) -> np.ndarray:
    """Return which drops meet the splash, bool ``(drops + 1,)``; the last is that of label -1.

    large : bool ``(drops + 1,)``, those that may lie beside it; the others must touch it.
    """
    cells = (fine.cells.coordinates + fine.start) // 2
    shape = liquid.level.shape
    inside = ((cells >= 0) & (cells < shape)).all(axis=1)
    level = np.full(len(label), AIR, dtype=np.float32)
    level[inside] = liquid.distance[tuple(cells[inside].T)]
    meets = np.zeros(label.max() + 2, dtype=bool)
    near = level < np.where(large, BESIDE, 0.0)[label]
    meets[label[near & (label >= 0)]] = True
    return meets


def smooth_union(liquid: LevelSet, fine: FineLevel, drawn: np.ndarray) -> LevelSet:
    """Return the union of the splash and the fine cells that are ``drawn``, bool ``(n,)``."""
    shape = liquid.grid.shape
    numbers, level, velocity = fine.coarse(shape, drawn)
    out = liquid.level.copy()
    flow = liquid.velocity.copy()
    nearer = level < np.minimum(out.ravel()[numbers], AIR)
    numbers = numbers[nearer]
    out.ravel()[numbers] = level[nearer]
    flow.reshape(3, -1)[:, numbers] = velocity[nearer].T * liquid.grid.spacing
    return replace(liquid, level=out, velocity=flow)
