# SPDX-License-Identifier: GPL-3.0-or-later
"""Solids as the liquid meets them: which faces they close, and particles kept out of them.

A solid is whatever answers :class:`Solid`: an analytic body or a voxelised mesh, at rest or moving.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np

from ..compiling import njit

COLLISION_SKIN = 0.1
"""Particles are kept this many cells outside of solids."""

NORMAL_STEP = 0.05
"""Cells to either side over which the distance's differences give a solid's normal."""

FACE_SAMPLES = 4
"""Points along each edge of a face at which its open share is sampled."""

FACE_REACH = 1.0
"""Cells from a cell's centre to a solid's surface beyond which its lower faces are all open, or all
closed: their samples lie within 0.73 cells."""

CELLS_AT_A_TIME = 1024
"""Cells whose faces are sampled together: their points fit into a processor's cache."""


class Solid(Protocol):
    """A solid in the liquid's box. Lengths in cells, points ``(n, 3)`` in cell coordinates."""

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance ``(n,)`` at ``points``, float64, negative inside."""

    def velocity(self, points: np.ndarray) -> np.ndarray:
        """Velocity ``(n, 3)`` of the solid's surface nearest to ``points``, cells/s.

        Zero for one at rest. Asked for near the surface and inside only.
        """


@runtime_checkable
class MovingSolid(Protocol):
    """A solid that moves: another one at every moment."""

    def at(self, time: float) -> Solid:
        """Return the solid at ``time``, seconds, with the velocity that it then has."""

    def fastest(self, begin: float, end: float) -> float:
        """Return the greatest speed of its surface between two moments, cells/s."""


def open_share(cells: np.ndarray, solid: Solid) -> np.ndarray:
    """Share of each lower face of ``cells`` ``(n, 3)`` that is not solid.

    Float32 ``(n, 3)``, 0..1, from 16 samples a face.
    """
    distance = solid.distance(cells + 0.5)
    share = np.zeros((len(cells), 3), dtype=np.float32)
    share[distance > FACE_REACH] = 1
    near = np.flatnonzero(np.abs(distance) <= FACE_REACH)
    points = np.empty((min(len(near), CELLS_AT_A_TIME), 3, FACE_SAMPLES**2, 3))
    for begin in range(0, len(near), CELLS_AT_A_TIME):
        some = near[begin : begin + CELLS_AT_A_TIME]
        sampled = points[: len(some)]
        _sample_faces(cells, some, sampled)
        _count_open(solid.distance(sampled.reshape(-1, 3)), some, share)
    return share


@njit(cache=True)
def _sample_faces(cells, some, points):
    """Write the samples of the faces of ``some`` cells into ``points`` ``(m, 3, 16, 3)``."""
    for n in range(len(some)):
        for axis in range(3):
            first, second = (axis == 0) * 1, 2 - (axis == 2) * 1
            for a in range(FACE_SAMPLES):
                for b in range(FACE_SAMPLES):
                    point = points[n, axis, a * FACE_SAMPLES + b]
                    point[axis] = cells[some[n], axis]
                    point[first] = cells[some[n], first] + (a + 0.5) / FACE_SAMPLES
                    point[second] = cells[some[n], second] + (b + 0.5) / FACE_SAMPLES


@njit(cache=True)
def _count_open(distance, some, share):
    """Set the shares of ``some`` cells, given the distance at their samples ``(m * 48,)``."""
    count = FACE_SAMPLES * FACE_SAMPLES
    for n in range(len(some)):
        for axis in range(3):
            is_open = 0
            for sample in range((3 * n + axis) * count, (3 * n + axis + 1) * count):
                is_open += distance[sample] > 0
            share[some[n], axis] = is_open / count


def wall_speed(cells: np.ndarray, share: np.ndarray, solid: Solid) -> np.ndarray | None:
    """Return how fast the solid moves across each lower face of ``cells`` ``(n, 3)``, cells/s.

    Float32 ``(n, 3)``, at the middles of the faces, 0 for open ones; None where nothing moves.
    share : the open share of each face.
    """
    closed = np.argwhere(share < 1)
    middles = cells[closed[:, 0]] + 0.5
    middles[np.arange(len(closed)), closed[:, 1]] -= 0.5
    speed = solid.velocity(middles)
    if not speed.any():
        return None
    out = np.zeros(share.shape, dtype=np.float32)
    out[closed[:, 0], closed[:, 1]] = speed[np.arange(len(closed)), closed[:, 1]]
    return out


def collide(positions: np.ndarray, velocities: np.ndarray, solid: Solid) -> None:
    """Push particles out of the solid and stop them from moving into it, in place.

    positions ``(n, 3)`` cells, velocities ``(n, 3)`` cells/s. What counts is the velocity relative
    to the solid's: a moving wall takes along what it meets. Velocity away from the solid is kept:
    liquid may leave a wall.
    """
    distance = solid.distance(positions)
    near = np.flatnonzero(~(distance > COLLISION_SKIN))
    if len(near):
        points = positions[near].astype(np.float64)
        gradient, speed = _differences(points, solid), solid.velocity(points)
        _push_out(positions, velocities, near, distance[near], gradient, speed)


def _differences(points: np.ndarray, solid: Solid) -> np.ndarray:
    """Differences ``(n, 3)`` of the distance across each of ``points``, along its gradient."""
    steps = NORMAL_STEP * np.eye(3)
    ahead, behind = (
        np.stack([solid.distance(points + way * step) for step in steps], axis=1) for way in (1, -1)
    )
    return np.asarray(ahead - behind)


@njit(cache=True)
def _push_out(positions, velocities, near, distance, gradient, speed):
    """Move the particles ``near`` out of the solid, see :func:`collide`."""
    for n in range(len(near)):
        p = near[n]
        nx, ny, nz = gradient[n, 0], gradient[n, 1], gradient[n, 2]
        size_n = max(np.sqrt(nx * nx + ny * ny + nz * nz), 1e-9)
        nx, ny, nz = nx / size_n, ny / size_n, nz / size_n
        push = COLLISION_SKIN - distance[n]
        positions[p, 0] += push * nx
        positions[p, 1] += push * ny
        positions[p, 2] += push * nz
        inward = velocities[p, 0] * nx + velocities[p, 1] * ny + velocities[p, 2] * nz
        inward -= speed[n, 0] * nx + speed[n, 1] * ny + speed[n, 2] * nz
        if inward < 0:
            # More the deeper it is: whether it is stopped must not depend on rounding.
            stop = inward * min(push / COLLISION_SKIN, 1.0)
            velocities[p, 0] -= stop * nx
            velocities[p, 1] -= stop * ny
            velocities[p, 2] -= stop * nz
