# SPDX-License-Identifier: GPL-3.0-or-later
"""Move points through a velocity field."""

from __future__ import annotations

import numpy as np
from numba import njit

from .cells import Cells
from .transfer import load_stencil, sample_face


def advect(positions: np.ndarray, cells: Cells, faces: np.ndarray, dt: float) -> np.ndarray:
    """Return ``positions`` moved by ``dt`` seconds along ``faces``, midpoint rule (RK2).

    positions : float32 ``(n, 3)`` in cells, sorted by cell for speed; faces : ``(cells, 3)``
    cells per second, extrapolated further than a particle moves in ``dt / 2``.
    """
    out = np.empty_like(positions)
    _midpoint(positions, cells.table, cells.leaves, faces, np.float32(dt), out)
    return out


@njit(cache=True, fastmath=True)
def _midpoint(positions, table, leaves, faces, dt, out):
    stencil = np.empty((3, 3, 3), dtype=np.int32)
    li, lj, lk = -9, -9, -9
    for p in range(len(positions)):
        x, y, z = positions[p, 0], positions[p, 1], positions[p, 2]
        for stage in range(2):
            i, j, k = int(x), int(y), int(z)
            if i != li or j != lj or k != lk:
                load_stencil(table, leaves, i, j, k, stencil)
                li, lj, lk = i, j, k
            step = dt if stage else dt / 2
            u = sample_face(x, y, z, i, j, k, 0, stencil, faces)
            v = sample_face(x, y, z, i, j, k, 1, stencil, faces)
            w = sample_face(x, y, z, i, j, k, 2, stencil, faces)
            x = positions[p, 0] + step * u
            y = positions[p, 1] + step * v
            z = positions[p, 2] + step * w
        out[p, 0], out[p, 1], out[p, 2] = x, y, z
