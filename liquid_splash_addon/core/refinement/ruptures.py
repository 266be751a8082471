# SPDX-License-Identifier: GPL-3.0-or-later
"""Air that has broken into the fronts of a splash: the inverse of droplets (paper, 5.1)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..liquid.fields import AIR
from ..liquid.level_set import LevelSet
from ..numeric.gradient import unit_gradient
from .blue_noise import balls_around
from .detail import Detail
from .droplets import SAMPLE_DISTANCE
from .front import band_cells, choose
from .particle_level import FineLevel
from .pbf import PbfParticles
from .settings import LARGEST_RADIUS, SMALL_DROP_PARTICLES, RuptureSettings

MOST_TRAIL_STEPS = 48
"""Most steps of a trail, which limits memory where the flow is fast."""

MOST_AIR = 4_000_000
"""Most particles of all trails before those in the same place are merged: about 0.5 GB."""


def add_ruptures(liquid: LevelSet, settings: RuptureSettings) -> Detail:
    """Return the splash with its fronts carved by air.

    Random points are chosen in the air ahead of the fronts. Around each a ball of blue-noise
    particles is made and moved back along the flow; the trails that the balls leave become air.
    """
    rng = np.random.default_rng(settings.seed)
    points = front_points(liquid, settings, rng)
    if not len(points):
        return Detail(liquid)
    air, warnings = trail(liquid, make_air(liquid, points, settings, rng), settings)
    fine = FineLevel.of(air)
    numbers, level, _ = fine.coarse(liquid.grid.shape, np.ones(len(fine.level), dtype=bool))
    out = liquid.level.copy()
    out.ravel()[numbers] = np.maximum(out.ravel()[numbers], np.minimum(-level, AIR))
    carved = replace(liquid, level=out)
    if not (out < 0).any():
        warnings.append("Ruptures left no liquid: lower their Amount or Size")
    return Detail(carved, carved.volume - liquid.volume, warnings)


def front_points(
    liquid: LevelSet, settings: RuptureSettings, rng: np.random.Generator
) -> np.ndarray:
    """Return random points ``(n, 3)``, cells, in the air that the splash moves into."""
    cells = band_cells(liquid, inside=False)
    if not len(cells) or settings.amount == 0:
        return np.zeros((0, 3), dtype=np.float32)
    outward = unit_gradient(liquid.distance, cells)
    flow = liquid.velocity[:, *cells.T].T
    speed = np.maximum(np.linalg.norm(flow, axis=1), 1e-9)
    ahead = (flow * outward).sum(axis=1) / speed
    # The paper's points are random; those ahead of the flow are the front.
    fronts = cells[ahead > 0.5]
    return choose(
        fronts, rng.random(len(fronts)), settings.amount, SAMPLE_DISTANCE * settings.size, rng
    )


def make_air(
    liquid: LevelSet, points: np.ndarray, settings: RuptureSettings, rng: np.random.Generator
) -> PbfParticles:
    """Return particles of air around ``points``."""
    radii = settings.size * np.exp(settings.spread * rng.normal(size=len(points)))
    radii = np.clip(radii, 0.5, LARGEST_RADIUS)
    counts = np.full(len(points), SMALL_DROP_PARTICLES)
    positions, spacing, group = balls_around(points, radii, counts, rng)
    velocities = liquid.flow_at(positions, points[group]).astype(np.float32)
    return PbfParticles(positions, velocities, spacing, group)


def trail(
    liquid: LevelSet, air: PbfParticles, settings: RuptureSettings
) -> tuple[PbfParticles, list[str]]:
    """Return the particles along their way back through the flow, and warnings.

    They follow the flow (midpoint rule), as air has no cohesion. Balls beyond MOST_AIR particles
    are left out.
    """
    speed = float(np.linalg.norm(air.velocities, axis=1).max(initial=0.0))
    # The balls of two steps overlap by more than half.
    steps = int(np.clip(np.ceil(settings.depth * speed / settings.size), 1, MOST_TRAIL_STEPS))
    dt = settings.depth / steps
    balls, fitting = (
        len(air.spacing) // SMALL_DROP_PARTICLES,
        MOST_AIR // (SMALL_DROP_PARTICLES * (steps + 1)),
    )
    warnings = []
    if fitting < balls:
        air = air.take(air.group < fitting)
        warnings.append(
            f"Ruptures: air breaks in at only {fitting} of {balls} places, as more would take too "
            "much memory (lower Amount or Depth, or raise Size)"
        )
    positions, parts = air.positions, [air]
    for _ in range(steps):
        half = positions - 0.5 * dt * liquid.flow_at(positions)
        positions = (positions - dt * liquid.flow_at(half)).astype(np.float32)
        parts.append(air._replace(positions=positions))
    whole = PbfParticles(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
    return thinned(whole), warnings


def thinned(air: PbfParticles) -> PbfParticles:
    """Return one particle for each cube of the size that one represents, as trails overlap."""
    cubes = np.floor(air.positions / air.spacing.mean()).astype(np.int64)
    _, first = np.unique(cubes @ np.array([1 << 40, 1 << 20, 1]), return_index=True)
    return air.take(np.sort(first))
