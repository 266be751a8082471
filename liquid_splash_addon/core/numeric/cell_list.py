# SPDX-License-Identifier: GPL-3.0-or-later
"""Things sorted by the cell, vertex or box they belong to: a counting sort, and what begins where.

``order[first[c] : first[c + 1]]`` are the things of cell c, in the order in which they came.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def counting_sort(keys, count):
    """Return the order of ``keys`` and where each key begins in it, int32 ``(n,)``, ``(count+1,)``.

    keys : int ``(n,)``, each from 0 to ``count`` - 1; equal ones stay in their order.
    """
    first = np.zeros(count + 1, dtype=np.int32)
    for n in range(len(keys)):
        first[keys[n] + 1] += 1
    for c in range(count):
        first[c + 1] += first[c]
    end = first[:-1].copy()
    order = np.empty(len(keys), dtype=np.int32)
    for n in range(len(keys)):
        order[end[keys[n]]] = n
        end[keys[n]] += 1
    return order, first


@njit(cache=True, nogil=True)
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
