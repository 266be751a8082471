# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes on a grid: the generator's condition (paper, 4.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .grid import LOCAL_SPACING, Grid
from .strokes import Stroke, resampled_points

CHANNELS = 7
VELOCITY, PLACE = slice(1, 4), slice(4, 7)
"""Channels of a condition; the first is occupancy. The paper's has no place."""


def rasterize(strokes: Sequence[Stroke], grid: Grid) -> np.ndarray:
    """Return the condition, float32 ``(7, X, Y, Z)``: occupancy, mean velocity, mean place.

    A cell is crossed, and its occupancy 1, if it holds a point of the strokes resampled at
    half a full-resolution cell (or half of its own, where that is less), so a draft's cell is
    crossed just where one of the eight cells in it is. Its velocity (m/s) and place (cells
    from its centre, -0.5..0.5) are the means of those points'. Points outside the grid are left
    out. Without the place, a sheet two cells thick is known to half a cell only.

    strokes : in local metres and m/s.
    """
    points, velocities = resampled_points(strokes, min(grid.spacing, LOCAL_SPACING) / 2)
    inside = grid.contains(points)
    cells = np.ravel_multi_index(tuple(grid.cell_of(points[inside]).T), grid.shape)
    crossed, which, count = np.unique(cells, return_inverse=True, return_counts=True)
    places = grid.to_cells(points[inside]) - grid.cell_of(points[inside]) - 0.5
    condition = np.zeros((CHANNELS, int(np.prod(grid.shape))), dtype=np.float32)
    condition[0, crossed] = 1
    for channel, values in enumerate([*velocities[inside].T, *places.T], start=1):
        condition[channel, crossed] = np.bincount(which, weights=values) / count
    return condition.reshape(CHANNELS, *grid.shape)


def outside_share(strokes: Sequence[Stroke], grid: Grid) -> float:
    """Return the share of the strokes' length outside ``grid``, 0..1."""
    points, _ = resampled_points(strokes, grid.spacing / 2)
    return float(1.0 - grid.contains(points).mean())
