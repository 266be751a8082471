# SPDX-License-Identifier: GPL-3.0-or-later
"""The liquid's time step, and runs of steps to a given time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..scale import GRAVITY
from .advection import advect
from .cells import Cells, activate, sort_by_cell
from .collision import MovingSolid, Solid, collide, open_share, wall_speed
from .density import crowding
from .extrapolation import extrapolate, valid_faces
from .particles import Particles
from .pressure import Poisson, project, spread_apart
from .sheets import resample_sheets
from .surface_tension import WATER, surface_pressure
from .transfer import faces_to_particles, particles_to_faces

AIR_LAYERS = 2
"""Least layers of air cells with a velocity, for steps of a cell at most: a particle moves half a
step to the midpoint."""

OPEN_MARGIN = 12.0
"""Liquid this many cells from the wall of the box is dropped: the box is open. The margin is
more than a step's travel (an impact can double the speed) and the air layers around it."""


@dataclass(frozen=True)
class Physics:
    """Terms of the physics that can be switched.

    Attributes
    ----------
    flip : 0 is APIC, 1 is FLIP; APIC's velocities are smooth, so thin sheets stay whole longer
    density : spread crowded particles apart, so that the liquid keeps its volume
    sheets : keep thin sheets sampled by splitting and merging particles
    tension : surface tension; at cells above 2 mm it only costs time
    cfl : cells that the fastest particle may move in a step
    """

    flip: float = 0.0
    density: bool = True
    sheets: bool = True
    tension: bool = False
    cfl: float = 1.0

    @property
    def layers(self) -> int:
        """Layers of air cells with a velocity."""
        return max(AIR_LAYERS, int(np.ceil(1 + self.cfl)))


@dataclass(frozen=True)
class Liquid:
    """The liquid at one moment; lengths in cells.

    Attributes
    ----------
    particles : what is in the box
    time : seconds
    emitted : volume at the start, cells^3; the rest of it has left the box
    """

    particles: Particles
    time: float
    emitted: float

    @classmethod
    def at_start(cls, particles: Particles) -> Liquid:
        """Liquid of these particles at time 0."""
        return cls(particles, 0.0, float(particles.volumes.sum(dtype=np.float64)))

    @property
    def left(self) -> float:
        """Volume that has left the box, cells^3."""
        return self.emitted - float(self.particles.volumes.sum(dtype=np.float64))


@dataclass(frozen=True)
class World:
    """What stays the same during a simulation.

    Attributes
    ----------
    cells : along each side of the box
    gravity : cells/s^2; tension : cells^3/s^2
    solid : what stands in the box, or moves in it; one that is nowhere has a large distance
        everywhere
    physics : what is switched on
    """

    cells: int
    gravity: float
    tension: float
    solid: Solid | MovingSolid
    physics: Physics = Physics()

    def solid_at(self, time: float) -> Solid:
        """Return what stands in the box at ``time``, seconds."""
        return self.solid.at(time) if isinstance(self.solid, MovingSolid) else self.solid

    def fastest_wall(self, begin: float, end: float) -> float:
        """Return the greatest speed of a wall between two moments, cells/s."""
        return self.solid.fastest(begin, end) if isinstance(self.solid, MovingSolid) else 0.0

    @classmethod
    def of_water(
        cls, spacing: float, cells: int, solid: Solid, physics: Physics | None = None
    ) -> World:
        """World of water on earth.

        spacing : edge of a cell, metres; cells : along each side of the box; solid : in cells
        """
        gravity, tension = GRAVITY / spacing, WATER / spacing**3
        return cls(cells, gravity, tension, solid, physics or Physics())


class Flow(NamedTuple):
    """Velocities on the faces of the active cells.

    Attributes
    ----------
    cells : the active cells
    before, after : float32 ``(cells, 3)`` cells/s, without and with forces and pressure,
        extrapolated into the air (``before`` only where FLIP is in use)
    apart : ``(cells, 3)`` cells, displacements that spread crowded particles; None where crowding
        is not looked at
    """

    cells: Cells
    before: np.ndarray
    after: np.ndarray
    apart: np.ndarray | None


def flow(
    particles: Particles,
    world: World,
    kick: float,
    dt: float = 0.0,
    layers: int = AIR_LAYERS,
    time: float = 0.0,
) -> Flow:
    """Flow that forces and pressure make of the particles' velocities.

    kick : what gravity adds to the downward velocity, cells/s; dt : seconds for which surface
    tension acts, 0 to leave out both it and crowding; layers : of air cells that get a velocity;
    time : at which moving solids are looked at, seconds.
    """
    cells = activate(particles.positions, (world.cells,) * 3, layers)
    faces, _ = particles_to_faces(particles, cells)
    solid = world.solid_at(time)
    share = open_share(cells.coordinates, solid)
    matrix = Poisson.assemble(cells, share)
    valid = valid_faces(cells, share)
    before = faces.copy()
    faces[:, 2] -= kick
    pull = world.tension * dt if world.physics.tension else 0.0
    outside = surface_pressure(particles, cells, pull) if pull > 0 else None
    walls = wall_speed(cells.coordinates, share, solid)
    faces = project(faces, cells, share, matrix, outside, walls)
    apart = None
    if dt > 0 and world.physics.density:
        away = solid.distance(cells.coordinates + 0.5)
        apart = spread_apart(crowding(particles, cells, away, share), cells, share, matrix)
        extrapolate(apart, valid, cells, layers)
    if world.physics.flip:  # only FLIP's change is taken against it
        extrapolate(before, valid, cells, layers)
    extrapolate(faces, valid, cells, layers)
    return Flow(cells, before, faces, apart)


def step(liquid: Liquid, world: World, dt: float) -> Liquid:
    """Advance the liquid by ``dt`` seconds: half of gravity, pressure, move, the other half.

    Solids that move are where they will be at the end of the step.
    """
    physics, half_kick, end = world.physics, world.gravity * dt / 2, liquid.time + dt
    cells, before, after, apart = flow(liquid.particles, world, half_kick, dt, physics.layers, end)
    order, counts = sort_by_cell(liquid.particles.positions, cells)
    # Transfer overwrites the affine part, and in APIC the velocities: sorting them is waste.
    old = liquid.particles
    particles = old._replace(
        positions=old.positions[order],
        velocities=old.velocities[order] if physics.flip else old.velocities,
        volumes=old.volumes[order],
        stretch=old.stretch[order],
    )
    particles, there = faces_to_particles(particles, cells, before, after, physics.flip)
    carrier = after if apart is None else after + apart / np.float32(dt)
    moved = particles._replace(positions=advect(particles.positions, there, cells, carrier, dt))
    if physics.sheets:
        moved = resample_sheets(moved, particles.positions, cells, counts, dt)
    moved.velocities[:, 2] -= half_kick
    collide(moved.positions, moved.velocities, world.solid_at(end))
    return replace(liquid, particles=kept_inside(moved, world), time=end)


def kept_inside(particles: Particles, world: World) -> Particles:
    """Particles that have not reached the open walls of the box."""
    inside = particles.within(OPEN_MARGIN, world.cells - OPEN_MARGIN)
    return particles if inside.all() else particles.take(inside)


def advance(liquid: Liquid, world: World, time: float, longest: float = np.inf) -> Liquid:
    """Advance the liquid to ``time`` in equal steps that keep to the CFL limit.

    longest : seconds that a step may take at most. The number of steps is 1, 2, 3, 4, 6, 8, 12,
    ..., so that one fast drop does not change every step a little: twins of a scene would drift
    apart by their errors in time.
    """
    while liquid.time < time - 1e-9 and len(liquid.particles.positions):
        left = time - liquid.time
        wanted = left * (liquid.particles.speed_limit() + world.gravity * left) / world.physics.cfl
        # Walls are looked at once a step: they may not move farther than a cell.
        wanted = max(wanted, left * world.fastest_wall(liquid.time, time), left / longest)
        if world.physics.tension:  # the shortest capillary waves (Brackbill 1992)
            wanted = max(wanted, left * np.sqrt(2 * np.pi * world.tension))
        power = 2 ** np.ceil(np.log2(max(wanted, 1.0)))
        fewer = 0.75 * power if power >= 4 else power
        liquid = step(liquid, world, left / (fewer if wanted <= fewer else power))
    return liquid
