# SPDX-License-Identifier: GPL-3.0-or-later
"""The particles that a simulation starts with."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..fluid.particles import Particles
from ..fluid.sheets import PARTICLE_SPACING
from ..fluid.step import Liquid, World
from ..numeric.trilinear import sample_field
from .domain import Domain
from .start import LooseDrops, Start

SEED = 0
"""Of the jitter."""

JITTER = 0.1
"""Largest displacement of a particle along each axis at the start, cells."""

OUTERMOST = PARTICLE_SPACING / 2
"""Depth of the outermost layer of particles below the surface, cells."""

GRADIENT_STEP = 0.5
"""Cells to either side over which the distance's differences give the surface's normal."""

LEAST_BALL = 0.4
"""Radius in cells from which a drop is several particles."""

AT_ONCE = 1 << 20
"""Places that are looked at together."""


def seed(
    start: Start, domain: Domain, world: World, pool: tuple[np.ndarray, np.ndarray] | None
) -> Liquid:
    """Return the liquid at the start: splash, pool and drops, outside of all solids.

    pool : lowest and highest corner of the basin's still liquid, cells; None without one.
    """
    parts = [splash_particles(start, domain)]
    if pool is not None:
        parts.append(pool_particles(*pool, parts[0].positions))
    parts.append(drop_particles(start.drops, domain))
    particles = Particles.joined(*parts)
    if len(particles.positions):
        outside = world.solid_at(0.0).distance(particles.positions.astype(np.float64)) > 0
        particles = particles.take(outside)
    if not len(particles.positions):
        raise ValueError(
            "No liquid is left to simulate: move the splash out of the obstacles and the ground, "
            "or raise Resolution"
        )
    return Liquid.at_start(particles)


def splash_particles(start: Start, domain: Domain) -> Particles:
    """Return particles on a lattice of eight a cell wherever there is liquid.

    The outermost layer, which lies up to a spacing deep, is moved to an even depth: the
    particles' surface would have its steps otherwise. All have the same volume, such that the sum
    is the level set's.
    """
    liquid = start.liquid
    box = liquid.box
    if box is None:
        return Particles.moving(np.zeros((0, 3)), np.zeros(3), 1.0)
    size = liquid.grid.spacing / domain.cell  # of the splash's cells, in the domain's
    corners = np.array(np.meshgrid(*([s.start, s.stop] for s in box), indexing="ij"))
    around = domain.to_cells(liquid.grid.to_metres(corners.reshape(3, -1).T))
    low, high = np.floor(around.min(axis=0)), np.ceil(around.max(axis=0))
    found = []
    for points in lattice(low, high):
        local = liquid.grid.to_cells(domain.to_local(points))
        depth = -distance_at(liquid.distance, local) * size
        points, depth = points[depth > 0], depth[depth > 0]
        outer = depth < 2 * OUTERMOST
        push = (OUTERMOST - depth[outer])[:, None]
        normal = normals_at(liquid.distance, liquid.grid.to_cells(domain.to_local(points[outer])))
        points[outer] -= push * (normal @ domain.turn.T)
        found.append(points)
    points = np.concatenate(found)
    points += np.random.default_rng(SEED).uniform(-JITTER, JITTER, points.shape)
    speed = liquid.flow_at(liquid.grid.to_cells(domain.to_local(points))) * liquid.grid.spacing
    volume = liquid.volume * size**3 / max(len(points), 1)
    particles = Particles.moving(points, np.zeros(3), volume)
    return particles._replace(velocities=domain.vectors_to_cells(speed).astype(np.float32))


def distance_at(distance: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return a distance field ``(X, Y, Z)`` at points ``(n, 3)`` in its cells."""
    return sample_field(distance[None], cells)[:, 0]


def normals_at(distance: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return unit vectors out of the liquid ``(n, 3)`` at points in the field's cells."""
    steps = GRADIENT_STEP * np.eye(3)
    slope = np.stack(
        [
            distance_at(distance, cells + step) - distance_at(distance, cells - step)
            for step in steps
        ],
        axis=1,
    ).astype(np.float64)
    return np.asarray(slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9))


def lattice(low: np.ndarray, high: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the points of a lattice of eight a cell in a box of whole cells, ``(n, 3)`` each."""
    axes = [np.arange(a, b, PARTICLE_SPACING) + OUTERMOST for a, b in zip(low, high, strict=True)]
    rows = max(AT_ONCE // max(len(axes[1]) * len(axes[2]), 1), 1)
    for begin in range(0, len(axes[0]), rows):
        parts = np.meshgrid(axes[0][begin : begin + rows], axes[1], axes[2], indexing="ij")
        yield np.stack(parts, axis=-1).reshape(-1, 3)


def pool_particles(low: np.ndarray, high: np.ndarray, splash: np.ndarray) -> Particles:
    """Return the still particles of a pool, a lattice from ``low`` to ``high`` (whole cells).

    Where the splash dips into it the splash's particles take their place: splash ``(n, 3)``.
    """
    points = np.concatenate([*lattice(low, high), np.zeros((0, 3))])
    inner = ((splash > low - 1) & (splash < high + 1)).all(axis=1)
    if inner.any():
        from scipy.spatial import cKDTree

        apart, _ = cKDTree(splash[inner]).query(points, distance_upper_bound=PARTICLE_SPACING)
        points = points[apart > 0.8 * PARTICLE_SPACING]
    return Particles.moving(points, np.zeros(3), PARTICLE_SPACING**3)


def drop_particles(drops: LooseDrops, domain: Domain) -> Particles:
    """Return the particles of drops: a lattice in each ball, or one for one that is too small."""
    places = domain.to_cells(drops.positions.astype(np.float64))
    speeds = domain.vectors_to_cells(drops.velocities.astype(np.float64))
    parts = [Particles.moving(np.zeros((0, 3)), np.zeros(3), 1.0)]
    for place, speed, radius in zip(places, speeds, drops.radii / domain.cell, strict=True):
        points = np.zeros((1, 3))
        if radius > LEAST_BALL:
            reach = np.full(3, np.ceil(radius))
            points = np.concatenate(list(lattice(-reach, reach)))
            points = points[(points**2).sum(axis=1) < (radius + 0.1 * PARTICLE_SPACING) ** 2]
        volume = 4 / 3 * np.pi * float(radius) ** 3 / len(points)
        parts.append(Particles.moving(points + place, speed, volume))
    return Particles.joined(*parts)
