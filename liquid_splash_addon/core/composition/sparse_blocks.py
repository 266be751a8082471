# SPDX-License-Identifier: GPL-3.0-or-later
"""A liquid stored in blocks, only where there is any, and its surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..compiling import njit
from ..grid import Grid
from ..liquid.level_set import LevelSet
from ..mesh.isosurface import isosurface
from ..mesh.mesh import Mesh
from ..mesh.taubin import taubin_smoothed
from ..numeric.trilinear import corner_weight
from ..obstacles.obstacles import (
    OBSTACLE_BAND,
    SWALLOWED,
    Clearance,
    Obstacle,
    ObstacleError,
    carved_level,
    clearance,
    tangential,
)

SIDE = 32
"""Cells along each side of a block."""

LEAST_LEVEL = 1e-3
"""Least absolute level, in cells: a vertex exactly in the centre of a cell would lie on several
edges of the grid."""


@dataclass(frozen=True)
class Blocks:
    """A liquid on a large grid, stored in blocks of SIDE^3 cells.

    Attributes
    ----------
    level : float32 ``(n, SIDE, SIDE, SIDE)``, cells, negative in the liquid
    velocity : float32 ``(n, 3, SIDE, SIDE, SIDE)``, drawing units per second
    starts : int64 ``(n, 3)``, first cell of each block, multiples of SIDE
    grid : the whole box, in drawing units, with a multiple of SIDE cells along each axis
    air : level outside the blocks
    """

    level: np.ndarray
    velocity: np.ndarray
    starts: np.ndarray
    grid: Grid
    air: float

    def table(self) -> np.ndarray:
        """Return the number of the block at each place, -1 for none, padded by one at each end."""
        table = np.full([n // SIDE + 2 for n in self.grid.shape], -1, dtype=np.int32)
        table[tuple((self.starts // SIDE + 1).T)] = np.arange(len(self.starts))
        return table

    def whole(self) -> LevelSet:
        """Return the liquid on the whole grid: takes 16 bytes for every cell of it."""
        level = np.full(self.grid.shape, np.float32(self.air))
        velocity = np.zeros((3, *self.grid.shape), dtype=np.float32)
        for n, start in enumerate(self.starts):
            box = tuple(slice(s, s + SIDE) for s in start)
            level[box], velocity[:, *box] = self.level[n], self.velocity[n]
        return LevelSet(level, velocity, self.grid)

    def carved(self, obstacles: Sequence[Obstacle], offset: float = 0.0) -> Blocks:
        """Return the liquid outside the obstacles, see :func:`~..obstacles.obstacles.carve`.

        Raises ObstacleError if no liquid is left.
        """
        if not obstacles:
            return self
        level, velocity = self.level.copy(), self.velocity.copy()
        for n, start in enumerate(self.starts):
            near = self.block_clearance(obstacles, start, OBSTACLE_BAND + offset)
            if near is not None:
                level[n] = carved_level(level[n], near, offset)
                velocity[n] = tangential(velocity[n], near, offset)
        if (self.level < 0).any() and not (level < 0).any():
            raise ObstacleError(SWALLOWED)
        return replace(self, level=level, velocity=velocity)

    def block_clearance(
        self, obstacles: Sequence[Obstacle], start: np.ndarray, band: float
    ) -> Clearance | None:
        """Return the distance to the obstacles in a block; None if all are too far away."""
        margin = int(np.ceil(band))
        x, y, z = (int(s) - margin for s in start)
        grid = self.grid.crop((x, y, z), (SIDE + 2 * margin,) * 3)
        low = np.array(grid.origin)
        high = low + grid.size
        parts = [part for o in obstacles if len((part := o.near(low, high)).triangles)]
        if not parts:
            return None
        inner = (slice(margin, -margin),) * 3
        distance = clearance(parts, grid, band).distance[inner]
        block = grid.crop((margin,) * 3, (SIDE,) * 3)
        return Clearance(np.ascontiguousarray(distance), band, block)

    def level_at(self, points: np.ndarray) -> np.ndarray:
        """Return the level (cells) of the cells that hold ``points`` ``(n, 3)``, drawing units."""
        cells = np.clip(self.grid.cell_of(points), -1, self.grid.shape)
        number = self.table()[tuple((cells // SIDE + 1).T)]
        here = tuple((cells % SIDE).T)
        return np.where(number < 0, np.float32(self.air), self.level[number, *here])

    def mesh(self) -> Mesh:
        """Return the liquid's surface in drawing units: closed, normals outward.

        Blocks are meshed one by one. They share the values on their common sides, so that their
        surfaces meet, and vertices there are merged.
        """
        vertices, faces = self.marched()
        if not len(faces):
            return Mesh.empty()
        cells = taubin_smoothed(vertices, faces)
        velocities = np.zeros((len(cells), 3), dtype=np.float32)
        _sample(self.velocity, self.table(), cells, velocities)
        points = self.grid.to_metres(cells + 0.5).astype(np.float32)
        return Mesh(points, faces.astype(np.int32), velocities)

    def marched(self) -> tuple[np.ndarray, np.ndarray]:
        """Return vertices ``(n, 3)`` in cells (centres at whole numbers) and faces ``(m, 3)``."""
        table = self.table()
        points, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), dtype=np.int64)], 0
        for n, start in enumerate(self.starts):
            level = self.level_with_sides(n, table)
            if (level < 0).all() or (level > 0).all():
                continue
            found, triangles = isosurface(level, 0.0)
            points.append(found + start.astype(np.float64))
            faces.append(triangles + count)
            count += len(found)
        return with_shared_vertices(np.concatenate(points), np.concatenate(faces))

    def level_with_sides(self, n: int, table: np.ndarray) -> np.ndarray:
        """Return the level of block n and the first cells of the next blocks, ``(SIDE + 1,) * 3``.

        No value is nearer to zero than LEAST_LEVEL.
        """
        level = np.full((SIDE + 1,) * 3, np.float32(self.air))
        i, j, k = self.starts[n] // SIDE + 1
        for a in (0, 1):
            for b in (0, 1):
                for c in (0, 1):
                    other = table[i + a, j + b, k + c]
                    if other >= 0:
                        to = tuple(slice(SIDE, None) if s else slice(SIDE) for s in (a, b, c))
                        of = tuple(slice(1) if s else slice(None) for s in (a, b, c))
                        level[to] = self.level[other][of]
        small = np.abs(level) < LEAST_LEVEL
        level[small] = np.where(level[small] < 0, np.float32(-LEAST_LEVEL), np.float32(LEAST_LEVEL))
        return level


def with_shared_vertices(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh of marching cubes with vertices on the same edge of the grid merged.

    points : ``(n, 3)``, with cell centres at whole numbers, so that two coordinates of a vertex are
    whole, except for vertices inside a cube, which belong to it alone.
    """
    if not len(points):
        return points, faces
    whole = np.abs(points - np.round(points)) < LEAST_LEVEL / 20
    base = np.where(whole, np.round(points), np.floor(points)).astype(np.int64)
    base -= base.min(axis=0)
    size = base.max(axis=0) + 1
    keys = ((base[:, 0] * size[1] + base[:, 1]) * size[2] + base[:, 2]) * 3
    keys += np.argmin(whole, axis=1)
    alone = whole.sum(axis=1) != 2
    keys[alone] = -1 - np.arange(alone.sum())
    _, first, place = np.unique(keys, return_index=True, return_inverse=True)
    return points[first], place[faces]


@njit(cache=True)
def _sample(velocity, table, cells, result):
    """Add the velocity at points (cells, centres at whole numbers) to ``result``, trilinearly."""
    for p in range(len(cells)):
        low = np.floor(cells[p]).astype(np.int64)
        share = cells[p] - low
        for corner in range(8):
            a, b, c = corner >> 2, corner >> 1 & 1, corner & 1
            i, j, k = low[0] + a, low[1] + b, low[2] + c
            n = table[i // SIDE + 1, j // SIDE + 1, k // SIDE + 1]
            if n >= 0:
                weight = corner_weight(share[0], share[1], share[2], a, b, c)
                for axis in range(3):
                    result[p, axis] += weight * velocity[n, axis, i % SIDE, j % SIDE, k % SIDE]
