# SPDX-License-Identifier: GPL-3.0-or-later
"""Flow On: the splash a few milliseconds later."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..fluid.particles import Particles
from ..fluid.step import advance
from ..fluid.transfer import sample
from ..grid import Grid
from ..liquid.fields import AIR
from ..liquid.level_set import LevelSet, fill_velocity
from ..progress import Report, silent
from ..scale import GRAVITY
from .domain import bounds_along
from .scene import Scene, prepare
from .settings import SimulationSettings
from .start import Start
from .surface import CLEARANCE, LAYERS, current_of, surface_of

MOST_MILLISECONDS = 10_000.0
"""Longest time that a splash is flown on."""

LOOK = 0.002
"""Seconds of the liquid's time between two reports."""

KNOWN = int(AIR) + 3
"""Layers of cells around the liquid that get a velocity: all with a level below AIR."""

AROUND = 6
"""Cells between the liquid and the end of its grid at least, where the grid can grow."""

MOST_GROWTH = 128
"""Cells by which a grid grows on each side at most; what flies farther is cut off."""


def flow_on(
    start: Start, milliseconds: float, report: Report = silent, gravity: float = GRAVITY
) -> LevelSet:
    """Return the splash ``milliseconds`` (0 to MOST_MILLISECONDS) of its own time later.

    Level in cells and velocity in m/s, on the grid of ``start.liquid``, which is larger by whole
    cells where the liquid has flown beyond it. 0 returns the liquid itself. Free drops are flown
    on with it and are part of it afterwards. Obstacles rest in their first pose;
    ``start.frame_seconds`` and ``ground`` are of no account.

    gravity : m/s^2, against ``start.up``; 0 for none. report : called with the share done; may
    raise Cancelled. Raises ValueError, with a sentence for the user, where there is no liquid.
    """
    if not 0 <= milliseconds <= MOST_MILLISECONDS:
        raise ValueError(
            f"Flow On must be from 0 to {MOST_MILLISECONDS:g} ms, not {milliseconds:g}"
        )
    if milliseconds == 0:
        return start.liquid
    report("Flowing on", 0.0)
    settings = SimulationSettings(
        gravity_strength=gravity, margin=margin_for(start, milliseconds / 1000, gravity)
    )
    scene = prepare(at_rest(start), settings, start.liquid.grid.spacing)
    liquid, seconds = scene.liquid, milliseconds / 1000
    looks = max(int(np.ceil(seconds / LOOK)), 1)
    for look in range(1, looks + 1):
        liquid = advance(liquid, scene.world, seconds * look / looks)
        report("Flowing on", 0.95 * look / looks)
    grid = grown(start.liquid.grid, liquid.particles, scene)
    return level_of(liquid.particles, scene, grid)


def grown(grid: Grid, particles: Particles, scene: Scene) -> Grid:
    """Return a grid in local space, larger by whole cells where particles need it."""
    places = grid.to_cells(scene.domain.to_local(particles.positions.astype(np.float64)))
    if not len(places):
        return grid
    low = np.minimum(np.floor(places.min(axis=0)) - AROUND, 0)
    high = np.maximum(np.ceil(places.max(axis=0)) + AROUND, grid.shape)
    low = np.maximum(low, -MOST_GROWTH).astype(int)
    high = np.minimum(high, np.add(grid.shape, MOST_GROWTH)).astype(int)
    x, y, z = (int(n) for n in high - low)
    return grid.crop((int(low[0]), int(low[1]), int(low[2])), (x, y, z))


def margin_for(start: Start, seconds: float, gravity: float) -> float:
    """Return a margin (see the settings) from which hardly any liquid gets out in that time."""
    speed = float(np.sqrt((start.liquid.velocity**2).sum(axis=0).max()))
    low, high = bounds_along(np.eye(3), start)
    way = 1.5 * (speed * seconds + gravity * seconds**2 / 2)
    return float(np.clip(way / (high - low).max(), 0.1, 4.0))


def at_rest(start: Start) -> Start:
    """Return the start with obstacles that keep to their first pose."""
    first = (replace(one, poses=one.poses[:1]) for one in start.obstacles)
    return replace(start, obstacles=tuple(first))


def level_of(particles: Particles, scene: Scene, grid: Grid) -> LevelSet:
    """Return the particles' surface and velocity as a level set on a grid in local space.

    The grid's cells are as large as the scene's.
    """
    margin = AROUND + LAYERS + 1
    local = scene.domain.to_local(particles.positions.astype(np.float64))
    placed = grid.to_cells(local) + margin
    inside = ((placed > LAYERS + 1) & (placed < np.add(grid.shape, 2 * margin - LAYERS - 1))).all(1)
    level = np.full(grid.shape, AIR, dtype=np.float32)
    velocity = np.zeros((3, *grid.shape), dtype=np.float32)
    if not inside.any():
        return LevelSet(level, velocity, grid)
    kept = particles.take(inside)._replace(positions=placed[inside].astype(np.float32))
    found, _ = surface_of(kept, max(grid.shape) + 2 * margin)
    cells = found.cells.coordinates - margin
    here = ((cells >= 0) & (cells < grid.shape)).all(axis=1)
    places = tuple(cells[here].T)
    middles = scene.domain.to_cells(grid.to_metres(cells[here] + 0.5))
    away = scene.world.solid_at(0.0).distance(middles)
    level[places] = np.maximum(found.level[here], (CLEARANCE - away).astype(np.float32))
    level = LevelSet(level, velocity, grid).distance
    current = current_of(particles, scene.world, 0.0, KNOWN)
    where = np.nonzero(level < AIR)
    middles = scene.domain.to_cells(grid.to_metres(np.stack(where, axis=1) + 0.5))
    speed = sample(middles.astype(np.float32), current.cells, current.after)
    velocity[:, *where] = scene.domain.vectors_to_local(speed.astype(np.float64)).T
    known = speed.any(axis=1)
    near = np.zeros(grid.shape, dtype=bool)
    near[tuple(axis[known] for axis in where)] = True
    fill_velocity(velocity, near, where, known, ~known)
    return LevelSet(level, velocity, grid)
