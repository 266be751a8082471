# SPDX-License-Identifier: GPL-3.0-or-later
"""For how long the liquid of a splash has flown, told from how fast its strokes were drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..grid import LOCAL_SPACING
from ..sketch.strokes import Stroke, arc_length, resample

FLIGHT = 0.25
"""Longest path in metres that liquid is taken to have flown; a pen may go on for longer."""

SLOWEST = 0.05
"""m/s, the least speed of flight: a resting pen says nothing about when the liquid was there."""

NEAREST_POINTS = 4
"""Points of strokes, the nearest ones, that tell how long liquid has flown."""


def flown(strokes: Sequence[Stroke]) -> tuple[np.ndarray, np.ndarray]:
    """Return points along the strokes ``(n, 3)``, metres, and for how long liquid there has flown.

    That is, in seconds ``(n,)``, since it left the stroke's beginning, or for FLIGHT metres at
    the speed there, whichever is less.
    """
    points, ages = [np.zeros((0, 3))], [np.zeros(0)]
    for stroke in strokes:
        dense = resample(stroke, LOCAL_SPACING)
        speed = np.linalg.norm(dense.velocities.astype(np.float64), axis=1)
        pace = 1 / np.maximum(speed, SLOWEST)
        steps = np.diff(arc_length(dense.points))
        since = np.concatenate([[0.0], np.cumsum(steps * (pace[1:] + pace[:-1]) / 2)])
        points.append(dense.points)
        ages.append(np.minimum(since, FLIGHT * pace))
    return np.concatenate(points), np.concatenate(ages)


def ages_at(metres: np.ndarray, points: np.ndarray, ages: np.ndarray) -> np.ndarray:
    """Return for how long liquid at ``metres`` ``(n, 3)`` has flown, seconds ``(n,)``.

    A mean over the nearest points of strokes, see :func:`flown`, the nearer the more.
    """
    from scipy.spatial import cKDTree

    count = min(NEAREST_POINTS, len(points))
    away, nearest = cKDTree(points).query(metres, k=[*range(1, count + 1)], workers=-1)
    weights = (away + LOCAL_SPACING) ** -2
    return np.asarray((weights * ages[nearest]).sum(axis=1) / weights.sum(axis=1))
