# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquid kept near its strokes, where a user wants lines rather than the sheets between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..mesh.marching_cubes import probability, surface_level
from ..sketch.strokes import Stroke, resampled_points
from .fields import Fields, settle
from .smooth_csg import cut

RIM = 2.0
"""Width in cells of the round edge where a sheet is cut."""


def within_reach(fields: Fields, strokes: Sequence[Stroke], reach: float) -> Fields:
    """Return the liquid that is no farther than ``reach`` metres from any stroke.

    strokes : in local metres, as the fields; reach : 0 for no bound.

    A generator spans sheets between strokes, as splashes do. Letters and thin figures are drawn
    with strokes that mean no sheet (paper, Fig. 14), and nothing in them says so.
    """
    if reach == 0:
        return fields
    grid = fields.grid
    level = surface_level(fields, 0.5)
    cells = np.nonzero(level < RIM)  # farther out there is air already, and most of the box is
    level = level[cells]
    away = stroke_distance(np.stack(cells, axis=1) + 0.5, strokes, fields) - reach / grid.spacing
    occupancy, distance = fields.occupancy.copy(), fields.distance.copy()
    occupancy[cells] = probability(cut(level, away, RIM))
    distance[cells] = cut(distance[cells], away, RIM)
    return settle(occupancy, distance, fields.velocity, grid)


def stroke_distance(cells: np.ndarray, strokes: Sequence[Stroke], fields: Fields) -> np.ndarray:
    """Return the distance in cells, float32 ``(n,)``, of cell coordinates to the nearest stroke."""
    from scipy.spatial import cKDTree

    points, _ = resampled_points(strokes, fields.grid.spacing / 2)
    nearest, _ = cKDTree(fields.grid.to_cells(points)).query(cells)
    return np.asarray(nearest, dtype=np.float32)
