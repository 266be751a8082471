# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes on a grid: the generator's condition (paper, 4.1)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..compiling import njit
from ..grid import LOCAL_SPACING, Grid
from ..sketch.strokes import Stroke, resampled_points
from .channels import CHANNELS, PATCH, STROKE, STROKE_OCCUPANCY
from .patches.sampling import PatchSamples

TIGHT = 4
"""Power of the closeness by which the sheets in a cell are weighted: the closest prevails."""


class Condition(NamedTuple):
    """What strokes and patches tell of a grid: only of the cells that they cross, one in a hundred.

    where : int32 ``(n, 3)``, the cells; values : float32 ``(n, 18)``, see ``channels``; shape :
    of the grid.
    """

    where: np.ndarray
    values: np.ndarray
    shape: tuple[int, int, int]

    @property
    def drawn(self) -> np.ndarray:
        """Cells that strokes cross, bool ``(X, Y, Z)``."""
        return self._marked(self.values[:, STROKE_OCCUPANCY] > 0)

    @property
    def crossed(self) -> np.ndarray:
        """Cells that strokes or patches cross, bool ``(X, Y, Z)``."""
        return self._marked(slice(None))

    def _marked(self, which: np.ndarray | slice) -> np.ndarray:
        cells = np.zeros(self.shape, dtype=bool)
        cells[tuple(self.where[which].T)] = True
        return cells

    def dense(self) -> np.ndarray:
        """All cells, float32 ``(18, X, Y, Z)``, zero where nothing crosses."""
        cells = np.zeros((*self.shape, CHANNELS), dtype=np.float32)
        cells[tuple(self.where.T)] = self.values
        return np.moveaxis(cells, 3, 0)


def voxelize(strokes: Sequence[Stroke], grid: Grid, patches: PatchSamples) -> Condition:
    """Put strokes and the patches between them on ``grid`` (paper, 4.1).

    A cell is crossed by a stroke, and its occupancy 1, if it holds a point of the strokes
    resampled at half a full-resolution cell (or half of its own, where that is less), so a
    draft's cell is crossed just where one of the eight cells in it is. Its velocity (m/s) and
    offset (cells from its centre) are the means of those points'. Points outside the grid are
    left out. Without the offset, a sheet two cells thick is known to half a cell only. The
    patches' channels are means of their samples in the cell, the closest patch before others.

    strokes : in local metres and m/s; patches : samples of theirs, with the classifier's verdicts.
    """
    points, velocities = resampled_points(strokes, min(grid.spacing, LOCAL_SPACING) / 2)
    low = np.asarray(grid.origin, dtype=np.float64)
    rows = np.full(grid.shape, -1, dtype=np.int32)
    count = _number(rows, points, low, grid.spacing, 0)
    count = _number(rows, patches.points, low, grid.spacing, count)
    where = np.empty((count, 3), dtype=np.int32)
    values = np.zeros((count, CHANNELS), dtype=np.float32)
    one = np.ones((len(points), 1), dtype=np.float32)
    seen = np.hstack([one, velocities])
    _average(rows, where, values[:, STROKE], points, seen, one[:, 0], low, grid.spacing)
    weights = patches.values[:, 0] ** TIGHT
    _average(
        rows, where, values[:, PATCH], patches.points, patches.values, weights, low, grid.spacing
    )
    return Condition(where, values, grid.shape)


@njit(cache=True, inline="always")
def _cell(point, low, spacing, shape, place, cell):
    """Set a point's coordinates and cell; tell whether that is in the grid."""
    inside = True
    for a in range(3):
        place[a] = (point[a] - low[a]) / spacing
        cell[a] = int(np.floor(place[a]))
        inside = inside and 0 <= cell[a] < shape[a]
    return inside


@njit(cache=True)
def _number(rows, points, low, spacing, count):
    """Give each cell that points lie in a row, from ``count`` on; return how many there are."""
    place, cell = np.empty(3), np.empty(3, dtype=np.int64)
    for n in range(len(points)):
        if _cell(points[n], low, spacing, rows.shape, place, cell):
            i, j, k = cell
            if rows[i, j, k] < 0:
                rows[i, j, k] = count
                count += 1
    return count


@njit(cache=True)
def _average(rows, where, values, points, seen, weights, low, spacing):
    """Set ``values`` ``(count, C + 3)`` to the means of what is ``seen`` ``(n, C)``, and the place.

    weights : ``(n,)``, above 0; where : the cells of the rows, set too.
    """
    channels = seen.shape[1]
    place, cell = np.empty(3), np.empty(3, dtype=np.int64)
    total = np.zeros(len(values), dtype=np.float32)
    for n in range(len(points)):
        if not _cell(points[n], low, spacing, rows.shape, place, cell):
            continue
        i, j, k = cell
        row = rows[i, j, k]
        total[row] += weights[n]
        part = weights[n] / total[row]
        for c in range(channels):
            values[row, c] += part * (seen[n, c] - values[row, c])
        for a in range(3):
            where[row, a] = cell[a]
            off = place[a] - cell[a] - 0.5
            values[row, channels + a] += part * (off - values[row, channels + a])


def outside_share(strokes: Sequence[Stroke], grid: Grid) -> float:
    """Return the share of the strokes' length outside ``grid``, 0..1."""
    points, _ = resampled_points(strokes, grid.spacing / 2)
    return float(1.0 - grid.contains(points).mean())
