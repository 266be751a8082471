# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface of simulated particles: a level on sparse cells, a mesh, and small drops apart."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiling import njit
from ..composition.sparse_blocks import SIDE, Blocks
from ..fluid.cells import Cells, activate, find, sort_by_cell
from ..fluid.collision import Solid
from ..fluid.particles import Particles
from ..fluid.step import Flow, World, flow
from ..fluid.transfer import sample
from ..grid import Grid
from ..liquid.fields import AIR
from ..mesh.mesh import Mesh

REACH = 2.5
"""Reach of a particle's weight, cells."""

RADIUS = 0.65
"""Distance in cells of the surface from the weighted mean of the particles near it. Thick liquid
then ends where it truly ends (0.05 cells farther out), and a sheet of one layer is 1.3 cells thick,
so that a grid can hold it."""

LAYERS = 3
"""Layers of cells around the particles that get a level."""

SMALLEST_PIECE = 1.5
"""Cells^3: a connected piece of liquid with less is a drop, and not in the mesh."""

CLEARANCE = 0.1
"""Cells of air between liquid and walls: faces in the same place would flicker in a render."""


class Surface(NamedTuple):
    """The particles' level on sparse cells.

    Attributes
    ----------
    cells : those that hold particles, and LAYERS around them
    level : float32 ``(n,)``, cells, negative in the liquid
    """

    cells: Cells
    level: np.ndarray


class Drops(NamedTuple):
    """Pieces of liquid too small for a mesh: float32, cells and cells per second."""

    positions: np.ndarray
    velocities: np.ndarray
    radii: np.ndarray


def surface_of(particles: Particles, cells_a_side: int) -> tuple[Surface, Drops]:
    """Return the level of particles in a box of ``cells_a_side`` cells, and small drops apart.

    The level is zero where a point is RADIUS away from the weighted mean of the particles in reach
    (Zhu and Bridson 2005).
    """
    cells = activate(particles.positions, (cells_a_side,) * 3, LAYERS)
    order, counts = sort_by_cell(particles.positions, cells)
    particles = particles.take(order)
    home = np.repeat(np.arange(cells.liquid), counts)
    piece = connected(cells)[home]
    small = np.bincount(piece, particles.volumes)[piece] < SMALLEST_PIECE
    sums = np.zeros((len(cells.coordinates), 4), dtype=np.float32)
    _accumulate(particles.positions, particles.volumes, small, cells.table, cells.leaves, sums)
    level = np.empty(len(sums), dtype=np.float32)
    _level(sums, level)
    # What is too thin for the grid beside other liquid: seen as drops too.
    lost = ~small
    lost[lost] = _unseen(particles.positions[lost], cells.table, cells.leaves, level)
    of_seen = lost & (np.bincount(piece, ~lost)[piece] > 0)
    piece[of_seen] = cells.liquid + home[of_seen]
    return Surface(cells, level), gathered(particles.take(small | lost), piece[small | lost])


def connected(cells: Cells) -> np.ndarray:
    """Return the number of the connected piece of each cell that holds particles, ``(liquid,)``.

    Cells that touch in a corner are connected.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    shape = (cells.liquid, cells.liquid)
    ends = _touching(cells.coordinates, cells.table, cells.leaves, cells.liquid)
    links = coo_matrix((np.ones(len(ends), dtype=np.int8), (ends[:, 0], ends[:, 1])), shape=shape)
    _, piece = connected_components(links, directed=False)
    return np.asarray(piece, dtype=np.int64)


@njit(cache=True)
def _touching(coordinates, table, leaves, liquid):
    """Return the pairs of touching cells that hold particles, int32 ``(n, 2)``."""
    pairs = np.empty((13 * liquid, 2), dtype=np.int32)
    count = 0
    for n in range(liquid):
        i, j, k = coordinates[n, 0], coordinates[n, 1], coordinates[n, 2]
        for side in range(14, 27):
            m = find(table, leaves, i + side // 9 - 1, j + side // 3 % 3 - 1, k + side % 3 - 1)
            if 0 <= m < liquid:
                pairs[count, 0], pairs[count, 1] = n, m
                count += 1
    return pairs[:count]


@njit(cache=True, fastmath=True)
def _accumulate(positions, volumes, left_out, table, leaves, sums):
    """Add each particle's weight, and that times its offset, to the cells in reach.

    positions : sorted by cell for speed; sums : float32 ``(n, 4)``
    """
    stencil = np.empty((6, 6, 6), dtype=np.int32)
    li, lj, lk = -9, -9, -9
    half, one = np.float32(0.5), np.float32(1)
    scale = np.float32(1 / (REACH * REACH))
    for p in range(len(positions)):
        if left_out[p]:
            continue
        x, y, z = positions[p, 0] - half, positions[p, 1] - half, positions[p, 2] - half
        i, j, k = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
        if i != li or j != lj or k != lk:
            for a in range(6):
                for b in range(6):
                    for c in range(6):
                        stencil[a, b, c] = find(table, leaves, i + a - 2, j + b - 2, k + c - 2)
            li, lj, lk = i, j, k
        for a in range(6):
            dx = x - np.float32(i + a - 2)
            for b in range(6):
                dy = y - np.float32(j + b - 2)
                flat = one - scale * (dx * dx + dy * dy)
                if flat <= 0:
                    continue
                for c in range(6):
                    dz = z - np.float32(k + c - 2)
                    near = flat - scale * dz * dz
                    n = stencil[a, b, c]
                    if near > 0 and n >= 0:
                        w = near * near * near * volumes[p]
                        sums[n, 0] += w
                        sums[n, 1] += w * dx
                        sums[n, 2] += w * dy
                        sums[n, 3] += w * dz


@njit(cache=True)
def _level(sums, level):
    for n in range(len(sums)):
        level[n] = AIR
        if sums[n, 0] > 0:
            far = np.sqrt(sums[n, 1] ** 2 + sums[n, 2] ** 2 + sums[n, 3] ** 2) / sums[n, 0]
            level[n] = min(far - RADIUS, AIR)


@njit(cache=True)
def _unseen(positions, table, leaves, level):
    """Return which particles have no cell of liquid within a cell, bool ``(n,)``."""
    out = np.ones(len(positions), dtype=np.bool_)
    for p in range(len(positions)):
        i, j, k = int(positions[p, 0]), int(positions[p, 1]), int(positions[p, 2])
        for side in range(27):
            n = find(table, leaves, i + side // 9 - 1, j + side // 3 % 3 - 1, k + side % 3 - 1)
            if n >= 0 and level[n] < 0:
                out[p] = False
                break
    return out


def gathered(particles: Particles, piece: np.ndarray) -> Drops:
    """Return a drop for each piece: its centre of mass, mean velocity and a ball's radius."""
    _, number = np.unique(piece, return_inverse=True)
    moving = np.concatenate([particles.positions, particles.velocities], axis=1)
    weight = np.bincount(number, particles.volumes)
    means = [np.bincount(number, particles.volumes * column) / weight for column in moving.T]
    found = np.stack([*means, np.cbrt(weight * 3 / (4 * np.pi))], axis=1).astype(np.float32)
    return Drops(found[:, :3], found[:, 3:6], found[:, 6])


def kept_out(surface: Surface, solid: Solid) -> Surface:
    """Return the surface without what is nearer than CLEARANCE to a solid."""
    away = solid.distance(surface.cells.coordinates + 0.5)
    level = np.maximum(surface.level, (CLEARANCE - away).astype(np.float32))
    return surface._replace(level=np.minimum(level, np.float32(AIR)))


def mesh_of(surface: Surface, solid: Solid, current: Flow) -> Mesh:
    """Return the surface's mesh, cells and cells/s; its vertices are outside of the solid.

    current : where velocities are taken from
    """
    mesh = blocks_of(surface).mesh()
    if not len(mesh.faces):
        return mesh
    vertices = mesh.vertices.astype(np.float64)
    away = solid.distance(vertices)
    near = np.flatnonzero(away < CLEARANCE)
    if len(near):
        steps = 0.05 * np.eye(3)
        slope = np.stack(
            [
                solid.distance(vertices[near] + s) - solid.distance(vertices[near] - s)
                for s in steps
            ],
            axis=1,
        )
        slope /= np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
        vertices[near] += (CLEARANCE - away[near])[:, None] * slope
    points = vertices.astype(np.float32)
    return Mesh(points, mesh.faces, sample(points, current.cells, current.after))


def current_of(particles: Particles, world: World, time: float, layers: int = LAYERS) -> Flow:
    """Return the flow at one moment, in the liquid and ``layers`` cells beyond.

    The particles' own velocities lack the pressure of the next step, which holds up what rests.
    """
    return flow(particles, world, kick=0.0, layers=layers, time=time)


def blocks_of(surface: Surface) -> Blocks:
    """Return the surface in blocks, without velocity; cells that are not active are air."""
    coordinates = surface.cells.coordinates
    if not len(coordinates):
        nothing = np.zeros((0, SIDE, SIDE, SIDE), dtype=np.float32)
        starts = np.zeros((0, 3), dtype=np.int64)
        grid = Grid((SIDE,) * 3, 1.0, (0.0, 0.0, 0.0))
        return Blocks(nothing, np.zeros((0, 3, SIDE, SIDE, SIDE), np.float32), starts, grid, AIR)
    low = coordinates.min(axis=0) // SIDE * SIDE
    shape = (coordinates.max(axis=0) // SIDE + 1) * SIDE - low
    counts = shape // SIDE
    place = (coordinates - low) // SIDE
    flat = (place[:, 0] * counts[1] + place[:, 1]) * counts[2] + place[:, 2]
    used, block = np.unique(flat, return_inverse=True)
    level = np.full((len(used), SIDE, SIDE, SIDE), AIR, dtype=np.float32)
    still = np.zeros((len(used), 3, SIDE, SIDE, SIDE), dtype=np.float32)
    i, j, k = ((coordinates - low) % SIDE).T
    level[block, i, j, k] = surface.level
    starts = np.stack(np.unravel_index(used, tuple(counts)), axis=1).astype(np.int64) * SIDE
    x, y, z = (int(n) for n in shape)
    corner = (float(low[0]), float(low[1]), float(low[2]))
    return Blocks(level, still, starts, Grid((x, y, z), 1.0, corner), AIR)
