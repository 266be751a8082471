# SPDX-License-Identifier: GPL-3.0-or-later
"""Points moved through a velocity field."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from .cells import Cells
from .transfer import load_stencil, sample_face


def advect(
    positions: np.ndarray, velocities: np.ndarray, cells: Cells, faces: np.ndarray, dt: float
) -> np.ndarray:
    """Return ``positions`` moved along ``faces`` for ``dt`` seconds by the midpoint rule (RK2).

    positions : float32 ``(n, 3)`` in cells, sorted by cell for speed; velocities : ``(n, 3)``,
    those of ``faces`` at the positions; faces : ``(cells, 3)``, cells per second, extrapolated
    farther than a particle moves in ``dt / 2``.
    """
    out = np.empty_like(positions)
    _midpoint(positions, velocities, cells.table, cells.leaves, faces, np.float32(dt), out)
    return out


@njit(cache=True, fastmath=True)
def _midpoint(positions, velocities, table, leaves, faces, dt, out):
    stencil = np.empty((3, 3, 3), dtype=np.int32)
    li, lj, lk = -9, -9, -9
    whole = False
    for p in range(len(positions)):
        x = positions[p, 0] + dt / 2 * velocities[p, 0]
        y = positions[p, 1] + dt / 2 * velocities[p, 1]
        z = positions[p, 2] + dt / 2 * velocities[p, 2]
        i, j, k = int(x), int(y), int(z)
        if i != li or j != lj or k != lk:
            whole = load_stencil(table, leaves, i, j, k, stencil)
            li, lj, lk = i, j, k
        for axis in range(3):
            u = sample_face(x, y, z, i, j, k, axis, stencil, whole, faces)
            out[p, axis] = positions[p, axis] + dt * u
