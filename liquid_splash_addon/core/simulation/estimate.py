# SPDX-License-Identifier: GPL-3.0-or-later
"""What a simulation will take, before it is begun."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..fluid.surface_tension import WATER
from .domain import bounds_along, cell_of, domain_of
from .scene import CFL, basin_of
from .settings import SimulationSettings
from .start import Start

PARTICLES_A_CELL = 8

MOST_SPLITTING = 4.0
"""Times as many particles as at the start that thin sheets are split into at most."""

STEP_SECONDS = 0.7e-6
"""Of one core, for a particle in a step, with what its cells take."""

FRAME_SECONDS = 1.6e-6
"""Of one core, for a particle in a frame's surface."""

PARTICLE_BYTES = 700.0
"""Of memory, for a particle: its state twice, and its share of cells, surface and mesh."""

STATE_BYTES = 100.0
"""On disc, for a particle of the last frame."""

FRAME_BYTES = 2.5
"""On disc, for a particle in a frame's mesh."""

BASE_BYTES = 300e6
"""Of memory, for Python and its libraries."""


class Estimate(NamedTuple):
    """What a simulation takes, to a factor of two or three.

    Attributes
    ----------
    particles : at the start
    memory : bytes, at most at once
    disc : bytes, all frames
    seconds : of one core of an ordinary computer
    """

    particles: int
    memory: float
    disc: float
    seconds: float


def estimate(start: Start, settings: SimulationSettings) -> Estimate:
    """Return what the simulation will take. It takes some hundredths of a second itself.

    ValueError, with a sentence for the user, where it cannot be run at all.
    """
    cell = cell_of(start.liquid, settings)
    domain = domain_of(start, settings, cell)
    volume = start.liquid.volume * (start.liquid.grid.spacing / cell) ** 3
    volume += float((4 / 3 * np.pi * (start.drops.radii / cell) ** 3).sum())
    splash, pool = int(PARTICLES_A_CELL * volume), 0
    if settings.ground == "POOL":
        basin = basin_of(start, settings, domain)
        pool = int(PARTICLES_A_CELL * np.prod(basin.high - basin.low))
    most = splitting(start, settings)
    mean = pool + splash * (1 + most) / 2
    steps = max(steps_in_frame(start, settings, cell), settings.least_substeps)
    frames = settings.frames + 1
    return Estimate(
        splash + pool,
        BASE_BYTES + PARTICLE_BYTES * (splash * most + pool),
        STATE_BYTES * (splash * most + pool) + FRAME_BYTES * mean * frames,
        mean * (steps * STEP_SECONDS + FRAME_SECONDS) * frames,
    )


def splitting(start: Start, settings: SimulationSettings) -> float:
    """Return how many times as many particles a splash has in the end: it spreads as it flies."""
    low, high = bounds_along(np.eye(3), start)
    size = float((high - low).max())
    way = speed_of(start) * start.frame_seconds * settings.frames
    return float(min((1 + min(way / size, settings.margin)) ** 2, MOST_SPLITTING))


def speed_of(start: Start) -> float:
    """Return the speed that a hundredth of the liquid exceeds, m/s."""
    moving = start.liquid.velocity[:, start.liquid.level < 0]
    return float(np.sqrt(np.quantile((moving**2).sum(axis=0), 0.99))) if moving.size else 0.0


def steps_in_frame(start: Start, settings: SimulationSettings, cell: float) -> float:
    """Return how many steps a frame takes, from the speed and the shortest capillary waves."""
    # And half of what the fall adds by the end.
    speed = speed_of(start) + settings.pull * start.frame_seconds * settings.frames / 2
    steps = start.frame_seconds * speed / cell / CFL
    if settings.tension:
        steps = max(steps, start.frame_seconds * np.sqrt(2 * np.pi * WATER / cell**3))
    return float(np.ceil(steps))
