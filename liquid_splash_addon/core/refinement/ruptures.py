# SPDX-License-Identifier: GPL-3.0-or-later
"""Air that has broken into a splash's fronts: the inverse of droplets (paper, 5.1)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..liquid.fields import AIR
from ..liquid.level_set import LevelSet, unit_gradient
from .blue_noise import PATTERNS, ball, random_turn
from .detail import Detail
from .droplets import ROOM
from .front import band_cells, choose
from .particle_level import FineLevel
from .pbf import Drops
from .settings import FEWEST, LARGEST, RuptureSettings

MOST_STEPS = 48
"""Steps of the way back: bounds memory where the flow is fast."""

MOST_AIR = 4_000_000
"""Particles on all ways back, before those in one place are made one: about 0.5 GB."""


def add_ruptures(liquid: LevelSet, settings: RuptureSettings) -> Detail:
    """Return the splash with its fronts carved by air.

    Random points in the air beside the fronts are chosen, a ball of blue-noise particles is made
    around each and moved back along the flow; where they come to lie, and on their way there,
    there is air.
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
    return choose(fronts, rng.random(len(fronts)), settings.amount, ROOM * settings.size, rng)


def make_air(
    liquid: LevelSet, points: np.ndarray, settings: RuptureSettings, rng: np.random.Generator
) -> Drops:
    """Return particles of air around ``points``."""
    radii = settings.size * np.exp(settings.spread * rng.normal(size=len(points)))
    radii = np.clip(radii, 0.5, LARGEST)
    parts = [
        ball(FEWEST, int(rng.integers(PATTERNS))) @ random_turn(rng) * radius + point
        for point, radius in zip(points, radii, strict=True)
    ]
    group = np.repeat(np.arange(len(points), dtype=np.int32), FEWEST)
    spacing = (radii * (4 / 3 * np.pi / FEWEST) ** (1 / 3)).astype(np.float32)
    positions = np.concatenate(parts).astype(np.float32)
    velocities = liquid.flow_at(positions, points[group]).astype(np.float32)
    return Drops(positions, velocities, spacing[group], group)


def trail(liquid: LevelSet, air: Drops, settings: RuptureSettings) -> tuple[Drops, list[str]]:
    """Return the particles along their way back through the flow, and warnings.

    They keep to the flow (midpoint rule), as air has no cohesion. Balls that would be too many
    are left out.
    """
    speed = float(np.linalg.norm(air.velocities, axis=1).max(initial=0.0))
    # The balls of two steps overlap by more than half.
    steps = int(np.clip(np.ceil(settings.depth * speed / settings.size), 1, MOST_STEPS))
    dt = settings.depth / steps
    balls, fitting = len(air.spacing) // FEWEST, MOST_AIR // (FEWEST * (steps + 1))
    warnings = []
    if fitting < balls:
        air = air.take(air.group < fitting)
        warnings.append(
            f"Ruptures: air breaks in at {fitting} of {balls} places, as more would take too much "
            "memory (lower Amount or Depth, or raise Size)"
        )
    positions, parts = air.positions, [air]
    for _ in range(steps):
        half = positions - 0.5 * dt * liquid.flow_at(positions)
        positions = (positions - dt * liquid.flow_at(half)).astype(np.float32)
        parts.append(air._replace(positions=positions))
    whole = Drops(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
    return thinned(whole), warnings


def thinned(air: Drops) -> Drops:
    """Return one of the particles in each cube that one stands for: trails overlap."""
    cubes = np.floor(air.positions / air.spacing.mean()).astype(np.int64)
    _, first = np.unique(cubes @ np.array([1 << 40, 1 << 20, 1]), return_index=True)
    return air.take(np.sort(first))
