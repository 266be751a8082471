# SPDX-License-Identifier: GPL-3.0-or-later
"""Splines as polylines: Bezier, Catmull-Rom and NURBS curves as Blender evaluates them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

STEPS = 12
"""Straight pieces that a segment between two points is read as; Blender's own default."""

UNIFORM, ENDPOINT, BEZIER, ENDPOINT_BEZIER = range(4)
"""Knots of a NURBS curve: all steps equal, through the ends, as Bezier pieces, or both."""


class Nurbs(NamedTuple):
    """What a NURBS curve has beside its points.

    order : degree + 1; knots : one of UNIFORM ...; weights : ``(n,)``
    """

    order: int
    knots: int
    weights: np.ndarray


def along_segments(values: np.ndarray) -> np.ndarray:
    """Interpolate ``values`` ``(n,)`` linearly where a spline of n points has its samples."""
    places = np.arange(STEPS * (len(values) - 1) + 1) / STEPS
    return np.interp(places, np.arange(len(values)), values)


def bezier_points(points: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Sample ``((n - 1) * STEPS + 1, 3)`` points on the Bezier curve through ``(n, 3)``.

    left, right : handles before and after each point; on a closed curve only for the first n - 1.
    """
    left, right = (np.append(side, side[:1], axis=0)[: len(points)] for side in (left, right))
    t = (np.arange(STEPS) / STEPS)[None, :, None]
    corners = [part[:, None, :] for part in (points[:-1], right[:-1], left[1:], points[1:])]
    weights = [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3]
    curve = sum(weight * corner for weight, corner in zip(weights, corners, strict=True))
    return np.append(np.reshape(curve, (-1, 3)), points[-1:], axis=0)


def catmull_rom_points(points: np.ndarray, is_closed: bool) -> np.ndarray:
    """Sample ``((n - 1) * STEPS + 1, 3)`` points on the Catmull-Rom spline through ``(n, 3)``.

    is_closed : whether the last point is the first one again. The piece between two points is the
    Bezier piece with handles a sixth of the way between their neighbours.
    """
    before = points[-2] if is_closed else points[0]
    after = points[1] if is_closed else points[-1]
    around = np.vstack([before, points, after])
    handle = (around[2:] - around[:-2]) / 6
    return bezier_points(points, points - handle, points + handle)


def nurbs_values(table: np.ndarray, nurbs: Nurbs, is_cyclic: bool) -> np.ndarray:
    """Sample a NURBS curve: all columns of a table ``(n, c)`` of its points, ``(m, c)``.

    A curve of fewer points than its order is the line through them, as in Blender.
    """
    from scipy.interpolate import BSpline

    degree = nurbs.order - 1
    if degree < 1 or len(table) < nurbs.order:
        return np.vstack([table, table[:1]]) if is_cyclic else table
    weights = nurbs.weights[:, None]
    table = np.hstack([table * weights, weights])
    if is_cyclic:
        table = np.vstack([table, table[:degree]])
    knots = knot_vector(len(nurbs.weights), nurbs, is_cyclic)
    first, last = knots[degree], knots[len(table)]
    count = STEPS * (len(nurbs.weights) - (0 if is_cyclic else 1)) + 1
    # Beyond the end there may be no curve to the right of it.
    places = np.minimum(np.linspace(first, last, count), np.nextafter(last, first))
    found = BSpline(knots, table, degree)(places)
    return np.asarray(found[:, :-1] / found[:, -1:])


def knot_vector(points: int, nurbs: Nurbs, is_cyclic: bool) -> np.ndarray:
    """Return the knots of a curve by Blender's rules, float64 ``(k,)``, not decreasing."""
    order = nurbs.order
    through_ends = nurbs.knots in (ENDPOINT, ENDPOINT_BEZIER)
    in_pieces = nurbs.knots in (BEZIER, ENDPOINT_BEZIER)
    repeat = order - 1 if in_pieces else 1
    left = order - is_cyclic if through_ends else (min(2, repeat) if in_pieces else 1)
    tail = 2 * order - 1 if is_cyclic else (order if through_ends else 0)
    total = points + (2 * order - 1 if is_cyclic else order)
    knots = np.zeros(total)
    current, start = 0.0, 0
    if through_ends and is_cyclic:
        current, start = 1.0, 1
    for place in range(start, total - tail):
        knots[place] = current
        left -= 1
        if left == 0:
            current, left = current + 1, repeat
    for place in range(tail):
        knots[total - tail + place] = current + knots[place] - knots[0]
    return knots
