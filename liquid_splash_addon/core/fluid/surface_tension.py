# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface tension, as a pressure in the air cells at the free surface."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from .cells import Cells
from .density import volume_share
from .particles import Particles

WATER = 7.28e-5
"""Surface tension of water over its density, m^3/s^2, at 20 degrees Celsius."""

SHARPEST_CURVATURE = 1.0
"""Largest curvature that counts, 1/cells: the grid cannot resolve more."""


def surface_pressure(particles: Particles, cells: Cells, strength: float) -> np.ndarray:
    """Return the pressure of the air cells beside liquid, float32 ``(cells,)``.

    It is ``strength`` times the curvature of the surface (Young and Laplace), from the
    divergence of the normal of the smoothed volume fraction (Brackbill 1992); positive where
    the liquid is convex.

    strength : sigma dt / rho in cells^3/s; the result is in the unit of ``pressure.project``,
    cells^2/s.
    """
    share = volume_share(particles, cells)
    for _ in range(2):
        share = _smooth(share, cells.neighbours)
    normal = _normals(share, cells.neighbours)
    curvature = np.clip(
        _normal_divergence(normal, cells.neighbours), -SHARPEST_CURVATURE, SHARPEST_CURVATURE
    )
    return np.asarray(strength * curvature, dtype=np.float32)


@njit(cache=True)
def _smooth(field, neighbours):
    out = np.empty_like(field)
    for n in range(len(field)):
        total = 6 * field[n]
        for side in range(6):
            if neighbours[n, side] >= 0:
                total += field[neighbours[n, side]]
        out[n] = total / 12
    return out


@njit(cache=True)
def _normals(share, neighbours):
    """Return unit vectors that point out of the liquid, zero where the share does not change."""
    normal = np.zeros((len(share), 3), dtype=np.float32)
    for n in range(len(share)):
        square = 0.0
        for axis in range(3):
            low, high = neighbours[n, 2 * axis], neighbours[n, 2 * axis + 1]
            below = share[low] if low >= 0 else 0.0
            above = share[high] if high >= 0 else 0.0
            normal[n, axis] = below - above
            square += normal[n, axis] ** 2
        if square > 1e-8:
            normal[n] /= np.sqrt(square)
    return normal


@njit(cache=True)
def _normal_divergence(normal, neighbours):
    """Return the divergence of the normals: 2 / radius on a ball."""
    out = np.zeros(len(normal), dtype=np.float32)
    for n in range(len(normal)):
        for axis in range(3):
            low, high = neighbours[n, 2 * axis], neighbours[n, 2 * axis + 1]
            if low >= 0 and high >= 0:
                out[n] += (normal[high, axis] - normal[low, axis]) / 2
    return out
