# SPDX-License-Identifier: GPL-3.0-or-later
"""Trilinear sampling of fields whose cell centres lie at i + 0.5."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def trilinear(field, x, y, z):
    """Return a scalar field ``(X, Y, Z)`` at a point in cells (centres at i + 0.5), clamped."""
    x = min(max(x - 0.5, 0.0), field.shape[0] - 1.001)
    y = min(max(y - 0.5, 0.0), field.shape[1] - 1.001)
    z = min(max(z - 0.5, 0.0), field.shape[2] - 1.001)
    i, j, k = int(x), int(y), int(z)
    a, b, c = x - i, y - j, z - k
    total = 0.0
    for di in range(2):
        for dj in range(2):
            for dk in range(2):
                weight = (a if di else 1 - a) * (b if dj else 1 - b) * (c if dk else 1 - c)
                total += weight * field[i + di, j + dj, k + dk]
    return total


@njit(cache=True)
def velocity_at(velocity, x, y, z, out):
    """Write the velocity at a point (cells of ``velocity``) into ``out``; return the speed.

    Cells with velocity zero are unknown and left out of the mean.
    """
    x = min(max(x - 0.5, 0.0), velocity.shape[0] - 1.001)
    y = min(max(y - 0.5, 0.0), velocity.shape[1] - 1.001)
    z = min(max(z - 0.5, 0.0), velocity.shape[2] - 1.001)
    i, j, k = int(x), int(y), int(z)
    a, b, c = x - i, y - j, z - k
    known = 0.0
    out[:] = 0.0
    for di in range(2):
        for dj in range(2):
            for dk in range(2):
                u = velocity[i + di, j + dj, k + dk]
                if u[0] != 0 or u[1] != 0 or u[2] != 0:
                    weight = (a if di else 1 - a) * (b if dj else 1 - b) * (c if dk else 1 - c)
                    known += weight
                    for axis in range(3):
                        out[axis] += weight * u[axis]
    if known > 0:
        for axis in range(3):
            out[axis] /= known
    return np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)


def sample_field(field: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return ``field`` ``(C, X, Y, Z)`` at cell coordinates ``(n, 3)``, trilinearly, ``(n, C)``."""
    from scipy.ndimage import map_coordinates

    where = (cells - 0.5).T
    columns = [map_coordinates(part, where, order=1, mode="nearest") for part in field]
    return np.stack(columns, axis=1).astype(np.float32)
