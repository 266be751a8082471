# SPDX-License-Identifier: GPL-3.0-or-later
"""Signed distance of the liquid that particles stand for."""

from __future__ import annotations

import numpy as np
from numba import njit

PARTICLE_RADIUS = 0.8
"""Radius of a particle's ball, cells. At 8 particles a cell their balls overlap until the
liquid is stretched to twice its length along two axes; below, sheets fill with holes."""

BAND = 3.0
"""Distances are exact up to this many cells and clipped there."""


def particle_distance(
    positions: np.ndarray, start: tuple[int, int, int], shape: tuple[int, int, int]
) -> np.ndarray:
    """Return the signed distance to the union of the particles' balls at cell centres.

    positions : float32 ``(n, 3)`` in cells; start : the cell at which the result begins.
    Returns float32 ``shape``, in cells, clipped to +-BAND, negative inside. Inside, it is the
    distance to the nearest particle minus the radius, so it bottoms out near -PARTICLE_RADIUS.
    """
    square = np.full(shape, np.float32((BAND + PARTICLE_RADIUS) ** 2), dtype=np.float32)
    _nearest(positions - np.asarray(start, dtype=np.float32), square, BAND + PARTICLE_RADIUS)
    return np.sqrt(square) - np.float32(PARTICLE_RADIUS)


@njit(cache=True, fastmath=True)
def _nearest(positions, square, reach):
    span = int(np.ceil(reach))
    for p in range(len(positions)):
        x, y, z = positions[p, 0] - 0.5, positions[p, 1] - 0.5, positions[p, 2] - 0.5
        i, j, k = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
        for a in range(max(i - span + 1, 0), min(i + span + 1, square.shape[0])):
            dx = (a - x) * (a - x)
            for b in range(max(j - span + 1, 0), min(j + span + 1, square.shape[1])):
                dxy = dx + (b - y) * (b - y)
                for c in range(max(k - span + 1, 0), min(k + span + 1, square.shape[2])):
                    d = dxy + (c - z) * (c - z)
                    if d < square[a, b, c]:
                        square[a, b, c] = d


def deepen(distance: np.ndarray, band: float = BAND) -> None:
    """Replace values inside the liquid by the distance to its surface, in place.

    Cells with a neighbour outside keep their value; the rest solve |grad d| = 1 by fast
    sweeping (Zhao 2005), clipped at ``-band``.

    distance : float32 ``(X, Y, Z)`` in cells.
    """
    _sweep_inside(distance, np.float32(band))


@njit(cache=True)
def _sweep_inside(distance, band):
    nx, ny, nz = distance.shape
    free = np.zeros(distance.shape, dtype=np.bool_)
    for i in range(1, nx - 1):
        for j in range(1, ny - 1):
            for k in range(1, nz - 1):
                free[i, j, k] = (
                    distance[i, j, k] < 0
                    and distance[i - 1, j, k] < 0
                    and distance[i + 1, j, k] < 0
                    and distance[i, j - 1, k] < 0
                    and distance[i, j + 1, k] < 0
                    and distance[i, j, k - 1] < 0
                    and distance[i, j, k + 1] < 0
                )
                if free[i, j, k]:
                    distance[i, j, k] = -band
    for sweep in range(8):
        for a in range(nx):
            i = a if sweep & 1 else nx - 1 - a
            for b in range(ny):
                j = b if sweep & 2 else ny - 1 - b
                for c in range(nz):
                    k = c if sweep & 4 else nz - 1 - c
                    if free[i, j, k]:
                        x = -max(distance[i - 1, j, k], distance[i + 1, j, k])
                        y = -max(distance[i, j - 1, k], distance[i, j + 1, k])
                        z = -max(distance[i, j, k - 1], distance[i, j, k + 1])
                        distance[i, j, k] = max(distance[i, j, k], -_eikonal(x, y, z))


@njit(cache=True, inline="always")
def _eikonal(x, y, z):
    """Solve (d - x)+^2 + (d - y)+^2 + (d - z)+^2 = 1 for d."""
    a, c = min(x, y, z), max(x, y, z)
    b = x + y + z - a - c
    d = a + 1.0
    if d > b:
        d = 0.5 * (a + b + np.sqrt(2.0 - (a - b) ** 2))
        if d > c:
            total = a + b + c
            d = (total + np.sqrt(total**2 - 3.0 * (a * a + b * b + c * c - 1.0))) / 3.0
    return np.float32(d)
