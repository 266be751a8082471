# SPDX-License-Identifier: GPL-3.0-or-later
"""The signed distance of a liquid from its particles."""

from __future__ import annotations

import numpy as np

from ..compiling import njit

KERNEL_REACH = 2.5
"""Reach of a particle's weight, cells."""

PARTICLE_RADIUS = 0.9
"""Distance in cells of the surface from the weighted mean of the particles near it: 0.4 outside the
outermost layer of thick liquid. A sheet of one layer becomes 1.8 cells thick, so that a grid can
hold it, and a lone particle a ball of this radius."""

DISTANCE_BAND = 3.0
"""Cells up to which distances are exact; there they are clipped."""


def particle_distance(
    positions: np.ndarray, volumes: np.ndarray, start: np.ndarray, shape: tuple[int, int, int]
) -> np.ndarray:
    """Return the signed distance of the particles' surface at cell centres.

    The distance to the zero set of :func:`particle_level`, with the same arguments: float32
    ``shape``, cells, clipped to +-DISTANCE_BAND, negative inside.
    """
    return redistance(particle_level(positions, volumes, start, shape))


def particle_level(
    positions: np.ndarray, volumes: np.ndarray, start: np.ndarray, shape: tuple[int, int, int]
) -> np.ndarray:
    """Return a level that is negative inside the particles' surface, float32 ``shape``, cells.

    The surface is where a point is PARTICLE_RADIUS away from the weighted mean of the particles
    around it (Zhu and Bridson 2005). Elsewhere the level is not a distance.

    positions : float32 ``(n, 3)`` in cells; volumes : ``(n,)``; start : cell at which the result
    begins.
    """
    sums = np.zeros((*shape, 4), dtype=np.float32)
    _accumulate(positions - np.asarray(start, dtype=np.float32), volumes, sums)
    level = np.empty(shape, dtype=np.float32)
    _level(sums, level)
    return level


@njit(cache=True, fastmath=True)
def _accumulate(positions, volumes, sums):
    """Add weights and weighted offsets (particle minus cell centre) to ``sums``."""
    span = int(np.ceil(KERNEL_REACH))
    scale = np.float32(1 / (KERNEL_REACH * KERNEL_REACH))
    nx, ny, nz, _ = sums.shape
    for p in range(len(positions)):
        x, y, z = positions[p, 0] - 0.5, positions[p, 1] - 0.5, positions[p, 2] - 0.5
        i, j, k = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
        for a in range(max(i - span + 1, 0), min(i + span + 1, nx)):
            dx = np.float32(x - a)
            for b in range(max(j - span + 1, 0), min(j + span + 1, ny)):
                dy = np.float32(y - b)
                for c in range(max(k - span + 1, 0), min(k + span + 1, nz)):
                    dz = np.float32(z - c)
                    near = np.float32(1) - scale * (dx * dx + dy * dy + dz * dz)
                    if near > 0:
                        w = near * near * near * volumes[p]
                        sums[a, b, c, 0] += w
                        sums[a, b, c, 1] += w * dx
                        sums[a, b, c, 2] += w * dy
                        sums[a, b, c, 3] += w * dz


@njit(cache=True, fastmath=True)
def _level(sums, level):
    nx, ny, nz = level.shape
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                weight = sums[i, j, k, 0]
                if weight <= 0:
                    level[i, j, k] = DISTANCE_BAND
                    continue
                square = sums[i, j, k, 1] ** 2 + sums[i, j, k, 2] ** 2 + sums[i, j, k, 3] ** 2
                level[i, j, k] = np.sqrt(square) / weight - PARTICLE_RADIUS


def redistance(level: np.ndarray, band: float = DISTANCE_BAND) -> np.ndarray:
    """Return the signed distance to the zero set of ``level``, in cells, clipped at +-``band``.

    Cells beside the zero set get ``level`` over the size of its gradient (Russo and Smereka 2000),
    the others solve |grad d| = 1 by fast sweeping (Zhao 2005). The outermost cells keep the sign
    of ``level`` and get the value ``band``.

    level : float32 ``(X, Y, Z)``, negative inside.
    """
    distance = np.empty_like(level)
    free = np.zeros(level.shape, dtype=np.bool_)
    _start(level, np.float32(band), distance, free)
    _sweep(distance, free)
    return np.copysign(distance, level)


@njit(cache=True)
def _start(level, band, distance, free):
    """Set unsigned distances beside the zero set; mark the other cells as ``free``."""
    nx, ny, nz = level.shape
    distance[:] = band
    for i in range(1, nx - 1):
        for j in range(1, ny - 1):
            for k in range(1, nz - 1):
                here = level[i, j, k]
                if here >= band:
                    free[i, j, k] = True
                    continue
                beside = False
                square = np.float32(0)
                for axis in range(3):
                    a, b, c = axis == 0, axis == 1, axis == 2
                    low, high = level[i - a, j - b, k - c], level[i + a, j + b, k + c]
                    beside |= (low < 0) != (here < 0) or (high < 0) != (here < 0)
                    # Beyond the particles' reach the gradient is unknown.
                    down = abs(here - low) if low < band else np.float32(0)
                    up = abs(here - high) if high < band else np.float32(0)
                    square += max(down, up) ** 2
                if beside:
                    distance[i, j, k] = min(abs(here) / max(np.sqrt(square), 1e-6), 1.0)
                else:
                    free[i, j, k] = True


@njit(cache=True)
def _sweep(distance, free):
    nx, ny, nz = distance.shape
    band = distance[0, 0, 0]
    for sweep in range(8):
        for a in range(1, nx - 1):
            i = a if sweep & 1 else nx - 1 - a
            for b in range(1, ny - 1):
                j = b if sweep & 2 else ny - 1 - b
                for c in range(1, nz - 1):
                    k = c if sweep & 4 else nz - 1 - c
                    if not free[i, j, k]:
                        continue
                    x = min(distance[i - 1, j, k], distance[i + 1, j, k])
                    y = min(distance[i, j - 1, k], distance[i, j + 1, k])
                    z = min(distance[i, j, k - 1], distance[i, j, k + 1])
                    if min(x, y, z) < band:
                        distance[i, j, k] = min(distance[i, j, k], _eikonal(x, y, z))


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
