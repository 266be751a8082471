# SPDX-License-Identifier: GPL-3.0-or-later
"""The sparse set of active cells: where the liquid is, and a few layers of air around it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiling import njit
from ..numeric.cell_list import counting_sort

BLOCK = 8
"""Cells along each side of a block, the leaf of the two-level table."""


class Cells(NamedTuple):
    """Active cells of a box: the first ``liquid`` of them hold particles, the others are air.

    Attributes
    ----------
    table : int32 ``(BX, BY, BZ)``, row of ``leaves`` of each block, -1 where none is active
    leaves : int32 ``(blocks, 8, 8, 8)``, number of each cell, -1 if it is not active
    coordinates : int32 ``(n, 3)``, position of each active cell in the box
    neighbours : int32 ``(n, 6)``, numbers of the cells at -x, +x, -y, +y, -z, +z; -1 if inactive
    liquid : how many cells hold liquid
    """

    table: np.ndarray
    leaves: np.ndarray
    coordinates: np.ndarray
    neighbours: np.ndarray
    liquid: int


def activate(positions: np.ndarray, shape: tuple[int, int, int], layers: int = 3) -> Cells:
    """Return the cells that hold particles and ``layers`` layers of air cells around them.

    positions : float32 ``(n, 3)`` in cells, all at least ``layers`` + 1 cells inside the box of
    ``shape`` cells. The first layer grows over all 26 neighbours, the others over 6.
    """
    table = np.full([-(-n // BLOCK) for n in shape], -1, dtype=np.int32)
    blocks = _number_blocks(positions, table, layers + 1)
    leaves = np.full((blocks, BLOCK, BLOCK, BLOCK), -1, dtype=np.int32)
    liquid = _mark_liquid(positions, table, leaves)
    index = np.empty((leaves.size, 3), dtype=np.int32)
    _number_liquid(table, leaves, index)
    count = _grow(table, leaves, index, liquid, layers)
    index = index[:count].copy()
    return Cells(table, leaves, index, _find_neighbours(table, leaves, index), liquid)


@njit(cache=True, inline="always")
def find(table, leaves, i, j, k):
    """Return the number of cell (i, j, k), or -1 if it is not active."""
    if i < 0 or j < 0 or k < 0:
        return -1
    bi, bj, bk = i >> 3, j >> 3, k >> 3
    if bi >= table.shape[0] or bj >= table.shape[1] or bk >= table.shape[2]:
        return -1
    row = table[bi, bj, bk]
    if row < 0:
        return -1
    return leaves[row, i & 7, j & 7, k & 7]


@njit(cache=True)
def _number_blocks(positions, table, reach):
    count = 0
    for p in range(len(positions)):
        i, j, k = int(positions[p, 0]), int(positions[p, 1]), int(positions[p, 2])
        for bi in range((i - reach) >> 3, ((i + reach) >> 3) + 1):
            for bj in range((j - reach) >> 3, ((j + reach) >> 3) + 1):
                for bk in range((k - reach) >> 3, ((k + reach) >> 3) + 1):
                    if table[bi, bj, bk] < 0:
                        table[bi, bj, bk] = count
                        count += 1
    return count


@njit(cache=True)
def _mark_liquid(positions, table, leaves):
    count = 0
    for p in range(len(positions)):
        i, j, k = int(positions[p, 0]), int(positions[p, 1]), int(positions[p, 2])
        row = table[i >> 3, j >> 3, k >> 3]
        if leaves[row, i & 7, j & 7, k & 7] == -1:
            leaves[row, i & 7, j & 7, k & 7] = -2
            count += 1
    return count


@njit(cache=True)
def _number_liquid(table, leaves, index):
    """Number the marked cells block by block, so that neighbours lie close in memory."""
    count = 0
    for bi in range(table.shape[0]):
        for bj in range(table.shape[1]):
            for bk in range(table.shape[2]):
                row = table[bi, bj, bk]
                if row < 0:
                    continue
                for i in range(BLOCK):
                    for j in range(BLOCK):
                        for k in range(BLOCK):
                            if leaves[row, i, j, k] == -2:
                                leaves[row, i, j, k] = count
                                index[count, 0] = bi * BLOCK + i
                                index[count, 1] = bj * BLOCK + j
                                index[count, 2] = bk * BLOCK + k
                                count += 1


@njit(cache=True)
def _grow(table, leaves, index, liquid, layers):
    start, count = 0, liquid
    for layer in range(layers):
        # Transfer needs all 26 neighbours of liquid; beyond, 6 are enough and keep spray cheap.
        furthest = 3 if layer == 0 else 1
        end = count
        for c in range(start, end):
            for i in range(-1, 2):
                for j in range(-1, 2):
                    for k in range(-1, 2):
                        if abs(i) + abs(j) + abs(k) > furthest:
                            continue
                        a, b, d = index[c, 0] + i, index[c, 1] + j, index[c, 2] + k
                        row = table[a >> 3, b >> 3, d >> 3]
                        if leaves[row, a & 7, b & 7, d & 7] == -1:
                            leaves[row, a & 7, b & 7, d & 7] = count
                            index[count, 0], index[count, 1], index[count, 2] = a, b, d
                            count += 1
        start = end
    return count


@njit(cache=True)
def _find_neighbours(table, leaves, index):
    neighbours = np.empty((len(index), 6), dtype=np.int32)
    for c in range(len(index)):
        i, j, k = index[c, 0], index[c, 1], index[c, 2]
        neighbours[c, 0] = find(table, leaves, i - 1, j, k)
        neighbours[c, 1] = find(table, leaves, i + 1, j, k)
        neighbours[c, 2] = find(table, leaves, i, j - 1, k)
        neighbours[c, 3] = find(table, leaves, i, j + 1, k)
        neighbours[c, 4] = find(table, leaves, i, j, k - 1)
        neighbours[c, 5] = find(table, leaves, i, j, k + 1)
    return neighbours


def sort_by_cell(positions: np.ndarray, cells: Cells) -> tuple[np.ndarray, np.ndarray]:
    """Return the order that puts particles of one cell next to each other, and counts.

    Order is int32 ``(n,)``; counts, int32 ``(liquid,)``, says how many particles each cell has.
    """
    home = _homes(positions, cells.table, cells.leaves)
    order, first = counting_sort(home, cells.liquid)
    return order, np.diff(first)


@njit(cache=True)
def _homes(positions, table, leaves):
    """Return the number of the cell that holds each particle, int32 ``(n,)``."""
    home = np.empty(len(positions), dtype=np.int32)
    for p in range(len(positions)):
        i, j, k = int(positions[p, 0]), int(positions[p, 1]), int(positions[p, 2])
        home[p] = leaves[table[i >> 3, j >> 3, k >> 3], i & 7, j & 7, k & 7]
    return home
