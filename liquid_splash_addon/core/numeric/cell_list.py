# SPDX-License-Identifier: GPL-3.0-or-later
"""Items sorted by the cell, vertex or box that they belong to, by a counting sort.

``order[first[c] : first[c + 1]]`` are the items of cell c, in their original order.
"""

from __future__ import annotations

import numpy as np

from ..compiling import njit


@njit(cache=True)
def counting_sort(keys, count):
    """Return the order of ``keys`` and where each key begins, int32 ``(n,)`` and ``(count + 1,)``.

    keys : int ``(n,)``, each from 0 to ``count`` - 1; equal ones stay in their order.
    """
    # Kept one place later than in the result: filling moves every beginning to the next one.
    first = np.zeros(count + 2, dtype=np.int32)
    for n in range(len(keys)):
        first[keys[n] + 2] += 1
    for c in range(count):
        first[c + 2] += first[c + 1]
    order = np.empty(len(keys), dtype=np.int32)
    for n in range(len(keys)):
        order[first[keys[n] + 1]] = n
        first[keys[n] + 1] += 1
    return order, first[:-1]


@njit(cache=True)
def cell_list(points, low, size, shape):
    """Return :func:`counting_sort` of ``points`` ``(n, 3)`` by cell, the last axis fastest.

    low : ``(3,)``, where the first cell begins; size : edge of a cell, in the points' unit;
    shape : cells along each axis, which hold all points.
    """
    keys = np.empty(len(points), dtype=np.int64)
    for n in range(len(points)):
        i = int((points[n, 0] - low[0]) / size)
        j = int((points[n, 1] - low[1]) / size)
        k = int((points[n, 2] - low[2]) / size)
        keys[n] = (i * shape[1] + j) * shape[2] + k
    return counting_sort(keys, shape[0] * shape[1] * shape[2])
