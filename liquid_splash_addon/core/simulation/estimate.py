# SPDX-License-Identifier: GPL-3.0-or-later
"""What a simulation will take, before it is begun."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..fluid.surface_tension import WATER
from .domain import cell_of, domain_of
from .scene import CFL, basin_of
from .settings import SimulationSettings
from .start import Start

PARTICLES_A_CELL = 8

STEP_SECONDS = 0.6e-6
"""Of one core, for a particle in a step, with what its cells take."""

FRAME_SECONDS = 1.2e-6
"""Of one core, for a particle in a frame's surface."""

PARTICLE_BYTES = 700.0
"""Of memory, for a particle: its state twice, and its share of cells, surface and mesh."""

STATE_BYTES = 100.0
"""On disc, for a particle of the last frame."""

FRAME_BYTES = 3.0
"""On disc, for a particle in a frame's mesh."""

BASE_BYTES = 300e6
"""Of memory, for Python and its libraries."""


class Estimate(NamedTuple):
    """What a simulation takes, to a factor of two.

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
    """Return what the simulation will take. A few milliseconds.

    ValueError, with a sentence for the user, where it cannot be run at all.
    """
    cell = cell_of(start.liquid, settings)
    domain = domain_of(start, settings, cell)
    volume = start.liquid.volume * (start.liquid.grid.spacing / cell) ** 3
    volume += float((4 / 3 * np.pi * (start.drops.radii / cell) ** 3).sum())
    if settings.ground == "POOL":
        basin = basin_of(start, settings, domain)
        volume += float(np.prod(basin.high - basin.low))
    particles = int(PARTICLES_A_CELL * volume)
    steps = max(steps_in_frame(start, settings, cell), settings.least_substeps)
    work = particles * (steps * STEP_SECONDS + FRAME_SECONDS)
    return Estimate(
        particles,
        BASE_BYTES + PARTICLE_BYTES * particles,
        STATE_BYTES * particles + FRAME_BYTES * particles * (settings.frames + 1),
        work * (settings.frames + 1),
    )


def steps_in_frame(start: Start, settings: SimulationSettings, cell: float) -> float:
    """Return how many steps a frame takes, from the speed and the shortest capillary waves."""
    moving = start.liquid.velocity[:, start.liquid.level < 0]
    speed = float(np.sqrt(np.quantile((moving**2).sum(axis=0), 0.99))) if moving.size else 0.0
    # Half of what the fall adds by the end.
    speed += settings.pull * start.frame_seconds * settings.frames / 2
    steps = start.frame_seconds * speed / cell / CFL
    if settings.tension:
        steps = max(steps, start.frame_seconds * np.sqrt(2 * np.pi * WATER / cell**3))
    return float(np.ceil(steps))
