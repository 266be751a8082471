# SPDX-License-Identifier: GPL-3.0-or-later
"""How full cells are, so that crowded particles can be spread apart again."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from .cells import Cells
from .particles import Particles
from .transfer import face_corner, load_stencil

LEAST_FREE_SHARE = 0.125
"""Free share of a cell's surroundings below which solids leave too little to judge crowding by."""

CROWDING_RELAXATION = 0.5
"""Share of the crowding that one step removes."""

MOST_CROWDING = 0.5
"""Crowding beyond this is removed over several steps."""

CROWDING_NOISE = 0.15
"""Crowding at a surface that is attributed to chance."""


def crowding(
    particles: Particles, cells: Cells, solid_distance: np.ndarray, open_share: np.ndarray
) -> np.ndarray:
    """Return the excess of liquid in each liquid cell, in cell volumes, float32 ``(liquid,)``.

    Positive where particles crowd. Negative, where they are too far apart, only in cells with
    liquid or solids on all sides: at a surface a cell may well be half empty.

    solid_distance : ``(cells,)``, signed distance to the solids at the cells' centres, cells;
    open_share : ``(cells, 3)``, part of each face that is not solid, 0..1.
    """
    full = volume_share(particles, cells) / np.maximum(free_share(solid_distance), LEAST_FREE_SHARE)
    excess = full[: cells.liquid] - 1
    inner = enclosed_cells(cells, open_share)
    # Rectified noise would inflate the surface, so a little crowding there does not count.
    excess = np.where(inner, excess, np.maximum(excess - CROWDING_NOISE, 0))
    return np.asarray(
        CROWDING_RELAXATION * np.clip(excess, -MOST_CROWDING, MOST_CROWDING), dtype=np.float32
    )


def enclosed_cells(cells: Cells, open_share: np.ndarray) -> np.ndarray:
    """Return which liquid cells have liquid or solids on all sides, bool ``(liquid,)``."""
    return np.asarray(_enclosed(cells.neighbours, open_share, cells.liquid))


@njit(cache=True)
def _enclosed(neighbours, open_share, liquid):
    out = np.ones(liquid, dtype=np.bool_)
    for c in range(liquid):
        for side in range(6):
            n = neighbours[c, side]
            if n >= liquid and open_share[n if side & 1 else c, side >> 1] > 0:
                out[c] = False
    return out


def free_share(solid_distance: np.ndarray) -> np.ndarray:
    """Return the share of the weight around cell centres that a flat wall leaves free, 0..1.

    The weight falls linearly to 0 one cell away, as in :func:`volume_share`. solid_distance : in
    cells, negative inside.
    """
    d = np.clip(solid_distance, -1, 1)
    return np.asarray(np.where(d > 0, 1 - (1 - d) ** 2 / 2, (1 + d) ** 2 / 2))


def volume_share(particles: Particles, cells: Cells) -> np.ndarray:
    """Return the volume of liquid around each cell's centre, float32 ``(cells,)``, 1 if full.

    The weight of a particle falls linearly from 1 at the centre to 0 a cell away.
    """
    out = np.zeros(len(cells.coordinates), dtype=np.float32)
    _deposit(particles.positions, particles.volumes, cells.table, cells.leaves, out)
    return out


@njit(cache=True, fastmath=True)
def _deposit(positions, volumes, table, leaves, share):
    stencil = np.empty((3, 3, 3), dtype=np.int32)
    li, lj, lk = -9, -9, -9
    one = np.float32(1)
    for p in range(len(positions)):
        x, y, z = positions[p, 0], positions[p, 1], positions[p, 2]
        i, j, k = int(x), int(y), int(z)
        if i != li or j != lj or k != lk:
            load_stencil(table, leaves, i, j, k, stencil)
            li, lj, lk = i, j, k
        # Weights about cell centres are those of a face in the other two directions.
        _, b, c, _, wy, wz = face_corner(x, y, z, i, j, k, 0)
        a, _, _, wx, _, _ = face_corner(x, y, z, i, j, k, 1)
        for da in range(2):
            ua = volumes[p] * (wx if da else one - wx)
            for db in range(2):
                ub = ua * (wy if db else one - wy)
                for dc in range(2):
                    w = ub * (wz if dc else one - wz)
                    share[stencil[a + da, b + db, c + dc]] += w
