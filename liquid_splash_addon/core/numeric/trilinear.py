# SPDX-License-Identifier: GPL-3.0-or-later
"""Trilinear sampling of fields whose cell centres lie at i + 0.5.

Fields have at least two cells along each axis. Outside the outermost centres, the values of the
nearest point between them are taken.
"""

from __future__ import annotations

import numpy as np

from ..compiling import njit


@njit(cache=True, inline="always")
def lower_centre(x, count):
    """Return the cell with the last centre at or before ``x`` and the share of the way to the next.

    x : cells, along an axis of ``count`` cells; the cell is never the last.
    """
    x = min(max(x - 0.5, 0.0), count - 1.0)
    i = max(min(int(x), count - 2), 0)
    return i, x - i


@njit(cache=True, inline="always")
def corner_weight(a, b, c, di, dj, dk):
    """Return the weight of one of the eight cells around a point.

    a, b, c : share of the way from the lower to the upper centres along each axis; di, dj, dk : 1
    for an upper one, 0 for a lower.
    """
    return (a if di else 1 - a) * (b if dj else 1 - b) * (c if dk else 1 - c)


@njit(cache=True)
def trilinear(field, x, y, z):
    """Return a scalar field ``(X, Y, Z)`` at a point in cells."""
    i, a = lower_centre(x, field.shape[0])
    j, b = lower_centre(y, field.shape[1])
    k, c = lower_centre(z, field.shape[2])
    total = 0.0
    for di in range(2):
        for dj in range(2):
            for dk in range(2):
                total += corner_weight(a, b, c, di, dj, dk) * field[i + di, j + dj, k + dk]
    return total


@njit(cache=True)
def velocity_at(velocity, x, y, z, out):
    """Write a velocity field ``(X, Y, Z, 3)`` at a point in cells into ``out``; return the speed.

    Cells whose velocity is zero are unknown and left out of the mean.
    """
    i, a = lower_centre(x, velocity.shape[0])
    j, b = lower_centre(y, velocity.shape[1])
    k, c = lower_centre(z, velocity.shape[2])
    known = 0.0
    out[:] = 0.0
    for di in range(2):
        for dj in range(2):
            for dk in range(2):
                u = velocity[i + di, j + dj, k + dk]
                if u[0] != 0 or u[1] != 0 or u[2] != 0:
                    weight = corner_weight(a, b, c, di, dj, dk)
                    known += weight
                    for axis in range(3):
                        out[axis] += weight * u[axis]
    if known > 0:
        for axis in range(3):
            out[axis] /= known
    return np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)


@njit(cache=True)
def components_at(field, x, y, z, out):
    """Write a field ``(C, X, Y, Z)`` at a point in cells into ``out`` ``(C,)``."""
    i, a = lower_centre(x, field.shape[1])
    j, b = lower_centre(y, field.shape[2])
    k, c = lower_centre(z, field.shape[3])
    out[:] = 0.0
    for di in range(2):
        for dj in range(2):
            for dk in range(2):
                weight = corner_weight(a, b, c, di, dj, dk)
                for n in range(len(out)):
                    out[n] += weight * field[n, i + di, j + dj, k + dk]


def sample_field(field: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return ``field`` ``(C, X, Y, Z)`` at ``points`` ``(n, 3)`` in cells, float32 ``(n, C)``."""
    sampled = np.empty((len(points), len(field)))
    _sample_field(field, np.asarray(points, dtype=np.float64), sampled)
    return sampled.astype(np.float32)


@njit(cache=True)
def _sample_field(field, points, sampled):
    for p in range(len(points)):
        components_at(field, points[p, 0], points[p, 1], points[p, 2], sampled[p])
