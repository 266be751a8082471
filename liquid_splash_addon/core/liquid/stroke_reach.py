# SPDX-License-Identifier: GPL-3.0-or-later
"""Keep liquid near its strokes, where a user wants lines rather than the sheets between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..grid import Grid
from ..sketch.strokes import Stroke, resampled_points
from .level_set import LevelSet
from .smooth_csg import smooth_maximum

CUT_WIDTH = 2.0
"""Width in cells of the round edge where a sheet is cut."""


def within_reach(liquid: LevelSet, strokes: Sequence[Stroke], reach: float) -> LevelSet:
    """Return the liquid that is no farther than ``reach`` metres from any stroke.

    strokes : in local metres, as the liquid; reach : 0 for no bound.

    A generator fills sheets between strokes, as splashes do. Letters and thin figures are drawn
    with strokes that mean no sheet (paper, Fig. 14), and nothing in the strokes says so.
    """
    if reach == 0:
        return liquid
    cells = np.nonzero(liquid.level < CUT_WIDTH)  # farther out there is air already
    away = stroke_distance(np.stack(cells, axis=1) + 0.5, strokes, liquid.grid)
    level = liquid.level.copy()
    level[cells] = smooth_maximum(level[cells], away - reach / liquid.grid.spacing, CUT_WIDTH)
    return replace(liquid, level=level)


def stroke_distance(cells: np.ndarray, strokes: Sequence[Stroke], grid: Grid) -> np.ndarray:
    """Return the distance in cells, float32 ``(n,)``, of cell coordinates to the nearest stroke."""
    from scipy.spatial import cKDTree

    points, _ = resampled_points(strokes, grid.spacing / 2)
    nearest, _ = cKDTree(grid.to_cells(points)).query(cells)
    return np.asarray(nearest, dtype=np.float32)
