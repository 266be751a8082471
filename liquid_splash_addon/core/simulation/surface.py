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
from ..grid import Grid
from ..liquid.fields import AIR
from ..mesh.mesh import Mesh

REACH = 2.5
"""Reach of a particle's weight, cells."""

RADIUS = 0.6
"""Distance in cells of the surface from the weighted mean of the particles near it. Thick liquid
then ends half a spacing outside of its outermost layer of particles, where it truly ends, and a
sheet of one layer is 1.5 cells thick, so that a grid can hold it."""

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
    velocity : float32 ``(n, 3)``, mean of the particles in reach
    """

    cells: Cells
    level: np.ndarray
    velocity: np.ndarray


def surface_of(particles: Particles, cells_a_side: int, layers: int = LAYERS) -> Surface:
    """Return the level of particles (Zhu and Bridson 2005) in a box of ``cells_a_side`` cells."""
    cells = activate(particles.positions, (cells_a_side,) * 3, layers)
    order, _ = sort_by_cell(particles.positions, cells)
    sums = np.zeros((len(cells.coordinates), 7), dtype=np.float32)
    _accumulate(
        particles.positions[order], particles.velocities[order], particles.volumes[order],
        cells.table, cells.leaves, sums,
    )  # fmt: skip
    known = np.maximum(sums[:, :1], 1e-12)
    level = np.linalg.norm(sums[:, 1:4] / known, axis=1) - np.float32(RADIUS)
    level[sums[:, 0] <= 0] = AIR
    return Surface(cells, level.astype(np.float32), sums[:, 4:] / known)


@njit(cache=True, fastmath=True)
def _accumulate(positions, velocities, volumes, table, leaves, sums):
    """Add each particle's weight, and that times its offset and velocity, to the cells in reach.

    positions : sorted by cell for speed; sums : float32 ``(n, 7)``
    """
    stencil = np.empty((6, 6, 6), dtype=np.int32)
    li, lj, lk = -9, -9, -9
    half, one = np.float32(0.5), np.float32(1)
    scale = np.float32(1 / (REACH * REACH))
    for p in range(len(positions)):
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
                        sums[n, 4] += w * velocities[p, 0]
                        sums[n, 5] += w * velocities[p, 1]
                        sums[n, 6] += w * velocities[p, 2]


def pieces_of(surface: Surface, particles: Particles) -> tuple[np.ndarray, np.ndarray]:
    """Return the connected piece of each cell and of each particle; -1 for a cell of air.

    A particle whose cell's centre lies outside of the surface belongs to a piece in the cells
    around it; where there is none, it is a piece with the others of its cell.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count = len(surface.level)
    wet = surface.level < 0
    above = surface.cells.neighbours[:, 1::2]
    ends = np.stack([np.repeat(np.arange(count), 3), above.ravel()])
    joined = wet[ends[0]] & (ends[1] >= 0) & wet[ends[1]]
    ends = ends[:, joined]
    links = coo_matrix((np.ones(ends.shape[1], dtype=np.int8), tuple(ends)), shape=(count, count))
    _, piece = connected_components(links, directed=False)
    piece[~wet] = -1
    own = _pieces_at(particles.positions, piece, surface.cells.table, surface.cells.leaves)
    return piece, own


@njit(cache=True)
def _pieces_at(positions, piece, table, leaves):
    out = np.empty(len(positions), dtype=np.int64)
    for p in range(len(positions)):
        i, j, k = int(positions[p, 0]), int(positions[p, 1]), int(positions[p, 2])
        home = find(table, leaves, i, j, k)
        out[p] = piece[home]
        if out[p] < 0:
            for side in range(27):
                a, b, c = side // 9 - 1, side // 3 % 3 - 1, side % 3 - 1
                n = find(table, leaves, i + a, j + b, k + c)
                if n >= 0:
                    out[p] = max(out[p], piece[n])
        if out[p] < 0:
            out[p] = len(piece) + home
    return out


class Drops(NamedTuple):
    """Pieces of liquid too small for a mesh: float32, cells and cells per second."""

    positions: np.ndarray
    velocities: np.ndarray
    radii: np.ndarray


def without_drops(surface: Surface, particles: Particles) -> tuple[Surface, Drops]:
    """Return the surface without its small pieces, and these: their centres and mean velocities."""
    piece, own = pieces_of(surface, particles)
    names, number = np.unique(own, return_inverse=True)
    volume = np.bincount(number, particles.volumes)
    small = volume < SMALLEST_PIECE
    level = surface.level.copy()
    level[np.isin(piece, names[small]) & (piece >= 0)] = AIR
    chosen = small[number]
    _, number = np.unique(own[chosen], return_inverse=True)
    drops = particles.take(chosen)
    moving = np.concatenate([drops.positions, drops.velocities], axis=1)
    weight = np.maximum(np.bincount(number, drops.volumes), 1e-12)
    means = np.stack([np.bincount(number, drops.volumes * c) / weight for c in moving.T], axis=1)
    radii = np.cbrt(weight * 3 / (4 * np.pi))
    found = Drops(*(array.astype(np.float32) for array in (means[:, :3], means[:, 3:], radii)))
    return surface._replace(level=level), found


def kept_out(surface: Surface, solid: Solid) -> Surface:
    """Return the surface without what is nearer than CLEARANCE to a solid."""
    away = solid.distance(surface.cells.coordinates + 0.5)
    level = np.maximum(surface.level, (CLEARANCE - away).astype(np.float32))
    return surface._replace(level=np.minimum(level, np.float32(AIR)))


def mesh_of(surface: Surface, solid: Solid) -> Mesh:
    """Return the surface's mesh, cells and cells/s; its vertices are outside of the solid."""
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
    return Mesh(vertices.astype(np.float32), mesh.faces, mesh.velocities)


def blocks_of(surface: Surface) -> Blocks:
    """Return the surface in blocks; cells that are not active are air."""
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
    velocity = np.zeros((len(used), 3, SIDE, SIDE, SIDE), dtype=np.float32)
    i, j, k = ((coordinates - low) % SIDE).T
    level[block, i, j, k] = surface.level
    for axis in range(3):
        velocity[block, axis, i, j, k] = surface.velocity[:, axis]
    starts = np.stack(np.unravel_index(used, tuple(counts)), axis=1).astype(np.int64) * SIDE
    x, y, z = (int(n) for n in shape)
    corner = (float(low[0]), float(low[1]), float(low[2]))
    return Blocks(level, velocity, starts, Grid((x, y, z), 1.0, corner), AIR)
