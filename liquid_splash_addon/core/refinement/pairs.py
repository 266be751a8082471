# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of particles near each other."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from ..numeric.cell_list import cell_list
from ..numeric.threads import in_parts

SUPPORT = 2.0
"""Reach of the kernels over the particles' spacing: about 33 neighbours."""

SLACK = 1.1
"""Pairs are found up to this many times the kernels' reach, so that a list stays valid after small
moves."""

USUAL_PAIRS = 32
"""Pairs of a particle that memory is reserved for at first."""

MOST_CELLS = 1 << 23
"""Most cells of the search grid; they are made larger if the particles are far apart."""


def find_pairs(positions: np.ndarray, spacing: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the first and second particles of all near pairs, int32 ``(pairs,)``.

    Each pair is listed once. positions : float32 ``(n, 3)``; spacing : float32 ``(n,)``, in the
    same unit.
    """
    if len(positions) < 2:
        nothing = np.zeros(0, dtype=np.int32)
        return nothing, nothing
    low = positions.min(axis=0)
    extent = positions.max(axis=0) - low
    size = float(SUPPORT * SLACK * spacing.max())
    while np.prod(extent.astype(np.float64) / size + 1) > MOST_CELLS:
        size *= 1.5
    shape = (extent / size).astype(np.int64) + 1
    grid = low, np.float32(size), shape
    sorted_by_cell = cell_list(positions, *grid)

    def pairs_of(start: int, stop: int) -> np.ndarray:
        capacity = USUAL_PAIRS * (stop - start)
        while True:
            found = np.empty((2, capacity), dtype=np.int32)
            count = _pairs(start, stop, positions, spacing, *grid, *sorted_by_cell, *found)
            if count <= capacity:
                return found[:, :count]
            capacity = count

    first, second = np.concatenate(in_parts(len(positions), pairs_of), axis=1)
    return first, second


@njit(cache=True, fastmath=True)
def _pairs(start, stop, positions, spacing, low, size, shape, order, begins, first, second):
    """Write the pairs of some particles with later ones as long as they fit; return how many."""
    count = 0
    for p in range(start, stop):
        i = int((positions[p, 0] - low[0]) / size)
        j = int((positions[p, 1] - low[1]) / size)
        k = int((positions[p, 2] - low[2]) / size)
        for a in range(max(i - 1, 0), min(i + 2, shape[0])):
            for b in range(max(j - 1, 0), min(j + 2, shape[1])):
                row = (a * shape[1] + b) * shape[2]
                begin = begins[row + max(k - 1, 0)]
                end = begins[row + min(k + 2, shape[2])]
                for place in range(begin, end):
                    q = order[place]
                    if q <= p:
                        continue
                    x = positions[p, 0] - positions[q, 0]
                    y = positions[p, 1] - positions[q, 1]
                    z = positions[p, 2] - positions[q, 2]
                    reach = 0.5 * SUPPORT * SLACK * (spacing[p] + spacing[q])
                    if x * x + y * y + z * z < reach * reach:
                        if count < len(first):
                            first[count] = p
                            second[count] = q
                        count += 1
    return count
