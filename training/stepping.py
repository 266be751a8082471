# SPDX-License-Identifier: GPL-3.0-or-later
"""One step of the liquid, and runs of steps to a given time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from liquid_splash_addon.core.fluid.advection import advect
from liquid_splash_addon.core.fluid.cells import Cells, activate, sort_by_cell
from liquid_splash_addon.core.fluid.extrapolation import extrapolate, valid_faces
from liquid_splash_addon.core.fluid.pressure import project
from liquid_splash_addon.core.fluid.transfer import faces_to_particles, particles_to_faces

from .obstacles import Obstacle, collide, open_share
from .scenes import Scene, fill

GRAVITY = 9.81
FLIP = 0.9
CFL = 2.0
"""Cells that the fastest particle may move in a step."""

LAYERS = 2
"""Layers of air cells with a velocity: a particle moves CFL / 2 cells to the midpoint."""

WALL = 12.0
"""Liquid this many cells from the wall of the box is dropped: the box is open. The margin is
more than a step's travel (an impact can double the speed) and the air layers around it."""


@dataclass(frozen=True)
class Liquid:
    """The liquid at one moment; lengths in cells.

    Attributes
    ----------
    positions, velocities : float32 ``(n, 3)``
    affine : float32 ``(n, 3, 3)``, APIC's velocity gradient, 1/s
    time : seconds
    emitted : particles at the start; ``emitted - n`` have left the box
    """

    positions: np.ndarray
    velocities: np.ndarray
    affine: np.ndarray
    time: float
    emitted: int


@dataclass(frozen=True)
class World:
    """What stays the same: the box's side in cells, gravity in cells/s^2, the obstacle in cells."""

    cells: int
    gravity: float
    obstacle: Obstacle

    @classmethod
    def of(cls, scene: Scene) -> World:
        """Return the world of ``scene``."""
        body, h = scene.obstacle, scene.spacing
        scaled = Obstacle(body.shape, body.size / h, body.height / h, body.centre / h, body.axes)
        return cls(scene.cells, GRAVITY / h, scaled)


def initial_liquid(scene: Scene, jitter_seed: int = 0) -> Liquid:
    """Return the streamlet of ``scene``; another ``jitter_seed`` makes a twin of it."""
    positions = fill(scene, np.random.default_rng([scene.seed, jitter_seed]))
    velocity = (scene.direction * scene.speed / scene.spacing).astype(np.float32)
    velocities = np.tile(velocity, (len(positions), 1))
    affine = np.zeros((len(positions), 3, 3), dtype=np.float32)
    return Liquid(positions, velocities, affine, 0.0, len(positions))


def flow(
    liquid: Liquid, world: World, dt: float, layers: int = LAYERS
) -> tuple[Cells, np.ndarray, np.ndarray]:
    """Return the active cells and the face velocities before and after forces and pressure.

    Both are extrapolated ``layers`` cells into the air.
    """
    cells = activate(liquid.positions, (world.cells,) * 3, layers)
    faces, _ = particles_to_faces(liquid.positions, liquid.velocities, liquid.affine, cells)
    share = open_share(cells.coordinates, world.obstacle)
    valid = valid_faces(cells, share)
    before = faces.copy()
    faces[:, 2] -= world.gravity * dt
    faces = project(faces, cells, share)
    extrapolate(before, valid, cells, layers)
    extrapolate(faces, valid, cells, layers)
    return cells, before, faces


def step(liquid: Liquid, world: World, dt: float) -> Liquid:
    """Advance the liquid by ``dt`` seconds: grid, forces, pressure, particles, move."""
    cells, before, after = flow(liquid, world, dt)
    order = sort_by_cell(liquid.positions, cells)
    positions, velocities = liquid.positions[order], liquid.velocities[order]
    velocities, affine = faces_to_particles(positions, velocities, cells, before, after, FLIP)
    positions = advect(positions, cells, after, dt)
    collide(positions, velocities, world.obstacle)
    moved = Liquid(positions, velocities, affine, liquid.time + dt, liquid.emitted)
    return drop_outside(moved, world)


def drop_outside(liquid: Liquid, world: World) -> Liquid:
    """Return the liquid without the particles that have reached the open walls of the box.

    A position that is not a number counts as outside.
    """
    inside = (liquid.positions > WALL).all(axis=1)
    inside &= (liquid.positions < world.cells - WALL).all(axis=1)
    if inside.all():
        return liquid
    return replace(
        liquid,
        positions=liquid.positions[inside],
        velocities=liquid.velocities[inside],
        affine=liquid.affine[inside],
    )


def advance(liquid: Liquid, world: World, time: float) -> Liquid:
    """Advance the liquid to ``time`` in equal steps that keep to the CFL limit."""
    while liquid.time < time - 1e-9 and len(liquid.positions):
        left = time - liquid.time
        fastest = float(np.sqrt((liquid.velocities**2).sum(axis=1).max()))
        limit = CFL / max(fastest + world.gravity * left, 1e-6)
        liquid = step(liquid, world, left / np.ceil(left / limit))
    return liquid
