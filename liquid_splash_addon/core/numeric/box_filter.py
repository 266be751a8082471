# SPDX-License-Identifier: GPL-3.0-or-later
"""Means over cubes of cells, taken around a few cells only."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from .threads import in_parts


def mean_around(values: np.ndarray, cells: np.ndarray, reach: int) -> np.ndarray:
    """Return the mean of the non-negative values around each cell, float32 ``(n,)``.

    NaN where there are none. values : float32 ``(X, Y, Z)``; cells : ``(n, 3)``; reach : cells
    to each side; the cube is clipped at the array's walls.
    """
    mean = np.empty(len(cells), dtype=np.float32)
    in_parts(len(cells), lambda a, b: _mean(values, cells[a:b], reach, mean[a:b]))
    return mean


@njit(cache=True)
def _mean(values: np.ndarray, cells: np.ndarray, reach: int, mean: np.ndarray) -> None:
    x, y, z = values.shape
    for n in range(len(cells)):
        i, j, k = cells[n]
        total, count = np.float32(0), 0
        for a in range(max(i - reach, 0), min(i + reach + 1, x)):
            for b in range(max(j - reach, 0), min(j + reach + 1, y)):
                for c in range(max(k - reach, 0), min(k + reach + 1, z)):
                    if values[a, b, c] >= 0:
                        total += values[a, b, c]
                        count += 1
        mean[n] = total / count if count else np.float32(np.nan)
