# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes on a grid: the generator's condition (paper, 4.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .grid import LOCAL_SPACING, Grid
from .strokes import Stroke, resampled_points


def rasterize(strokes: Sequence[Stroke], grid: Grid) -> np.ndarray:
    """Return the condition, float32 ``(4, X, Y, Z)``: occupancy, then mean velocity in m/s.

    A cell is crossed, and its occupancy 1, if it holds a point of the strokes resampled at
    half a full-resolution cell (or half of its own, where that is less), so a draft's cell is
    crossed just where one of the eight cells in it is. Its velocity is the mean of those
    points' velocities. Points outside the grid are left out.

    strokes : in local metres and m/s.
    """
    points, velocities = resampled_points(strokes, min(grid.spacing, LOCAL_SPACING) / 2)
    inside = grid.contains(points)
    cells = np.ravel_multi_index(tuple(grid.cell_of(points[inside]).T), grid.shape)
    total = int(np.prod(grid.shape))
    count = np.bincount(cells, minlength=total)
    condition = np.zeros((4, total), dtype=np.float32)
    condition[0] = count > 0
    for axis in range(3):
        sums = np.bincount(cells, weights=velocities[inside, axis], minlength=total)
        condition[1 + axis] = sums / np.maximum(count, 1)
    return condition.reshape(4, *grid.shape)


def clamp_speed(condition: np.ndarray, limit: float) -> np.ndarray:
    """Return ``condition`` with speeds above ``limit`` (m/s) shortened to it."""
    speed = np.linalg.norm(condition[1:], axis=0)
    clamped = condition.copy()
    clamped[1:] *= np.minimum(1.0, limit / np.maximum(speed, 1e-12))
    return clamped


def outside_share(strokes: Sequence[Stroke], grid: Grid) -> float:
    """Return the share of the strokes' length outside ``grid``, 0..1."""
    points, _ = resampled_points(strokes, grid.spacing / 2)
    return float(1.0 - grid.contains(points).mean())
