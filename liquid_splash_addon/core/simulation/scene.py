# SPDX-License-Identifier: GPL-3.0-or-later
"""A start and settings as what the solver takes: a box of cells, its walls, and particles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fluid.collision import Solid
from ..fluid.step import Liquid, Physics, World
from ..fluid.surface_tension import WATER
from .domain import Domain, bounds_along, cell_of, domain_of
from .seeding import seed
from .settings import SimulationSettings
from .start import Start
from .walls import Basin, Floor, PosedObstacle, walls

CFL = 2.0
"""Cells that the fastest liquid may move in a step. Half as many take twice the time and look
the same."""

POOL_ROOM = 0.25
"""Room around the splash that a pool takes up, over the longest side of the splash's box; never
more than the domain's."""

LEAST_POOL = 2
"""Cells of a pool's depth at least."""


@dataclass(frozen=True)
class Scene:
    """A simulation, ready to run.

    Attributes
    ----------
    domain : where its cells lie
    world, liquid : for the solver
    warnings : sentences for the user
    """

    domain: Domain
    world: World
    liquid: Liquid
    warnings: tuple[str, ...] = ()


def prepare(start: Start, settings: SimulationSettings, cell: float | None = None) -> Scene:
    """Return a simulation's scene. Raises ValueError with a sentence for the user.

    cell : edge of a cell, metres; None for that of the settings.
    """
    domain = domain_of(start, settings, cell or cell_of(start.liquid, settings))
    basin = basin_of(start, settings, domain) if settings.ground == "POOL" else None
    obstacles = [PosedObstacle(one, domain, start.frame_seconds) for one in start.obstacles]
    solid = walls(ground_of(start, settings, domain, basin), obstacles)
    physics = Physics(tension=settings.tension, cfl=CFL)
    tension = WATER / domain.cell**3
    world = World(domain.cells, settings.pull / domain.cell, tension, solid, physics)
    liquid = seed(start, domain, world, None if basin is None else (basin.low, basin.high))
    return Scene(domain, world, liquid, tuple(one.warning for one in obstacles if one.warning))


def ground_of(
    start: Start, settings: SimulationSettings, domain: Domain, basin: Basin | None
) -> Solid | None:
    """Return the ground, in cells."""
    if settings.ground == "NONE":
        return None
    return basin or Floor(ground_height(start, domain))


def ground_height(start: Start, domain: Domain) -> float:
    """Return how high the ground lies, in cells: a whole number, as the domain is aligned to it."""
    return float(np.round((start.ground - domain.corner[2]) / domain.cell))


def basin_of(start: Start, settings: SimulationSettings, domain: Domain) -> Basin:
    """Return the basin of a pool, in whole cells."""
    low, high = bounds_along(domain.turn, start)
    room = min(settings.margin, POOL_ROOM) * float((high - low).max())
    low, high = ((bound - domain.corner) / domain.cell for bound in (low - room, high + room))
    low, high = np.floor(low), np.ceil(high)
    high[2] = ground_height(start, domain)
    low[2] = high[2] - max(np.round(settings.pool_depth / domain.cell), LEAST_POOL)
    return Basin(low, high)
