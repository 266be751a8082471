# SPDX-License-Identifier: GPL-3.0-or-later
"""Closest points on triangle meshes; triangles as in :mod:`.signed_distance`."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from ..numeric.cell_list import cell_list
from .signed_distance import closest_on_triangle, vertical_hit


def nearest_on_mesh(
    triangles: np.ndarray, points: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return distance ``(n,)``, closest point ``(n, 3)`` and winding number ``(n,)`` of points.

    Exact below a distance of ``reach``; points farther away get ``reach`` and themselves.
    points : float64 ``(n, 3)``, in the unit of the triangles.
    """
    square = np.full(len(points), float(reach) ** 2)
    nearest = points.copy()
    winding = np.zeros(len(points), dtype=np.int32)
    if len(points) and len(triangles):
        low = points.min(axis=0)
        size = np.ptp(points, axis=0)
        # Bins about as large as the reach, but not more than about a million of them.
        edge = max(reach, float((np.prod(size + reach) / 1e6) ** (1 / 3)))
        counts = (size / edge).astype(np.int64) + 1
        order, starts = cell_list(points, low, edge, counts)
        binned = (low, edge, counts, order, starts)
        _nearest(triangles, points, reach, *binned, square, nearest)
        _count_at(triangles, points, *binned, winding)
    return np.sqrt(square), nearest, winding


@njit(cache=True)
def _nearest(triangles, points, reach, low, edge, counts, order, starts, square, nearest):
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    least, greatest = np.empty(3), np.empty(3)
    for m in range(len(triangles)):
        t = triangles[m]
        for a in range(3):
            least[a], greatest[a] = t[:, a].min(), t[:, a].max()
            begin, end = least[a] - reach - low[a], greatest[a] + reach - low[a]
            first[a] = np.int64(np.floor(max(begin / edge, 0.0)))
            last[a] = np.int64(np.floor(min(end / edge, counts[a] - 1.0)))
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                row = (i * counts[1] + j) * counts[2]
                if last[2] < first[2]:
                    continue
                for n in range(starts[row + first[2]], starts[row + last[2] + 1]):
                    p = order[n]
                    apart = 0.0
                    for a in range(3):
                        over = max(least[a] - points[p, a], points[p, a] - greatest[a], 0.0)
                        apart += over * over
                    if apart >= square[p]:
                        continue
                    x, y, z = closest_on_triangle(points[p, 0], points[p, 1], points[p, 2], t)
                    found = (
                        (points[p, 0] - x) ** 2 + (points[p, 1] - y) ** 2 + (points[p, 2] - z) ** 2
                    )
                    if found < square[p]:
                        square[p] = found
                        nearest[p, 0], nearest[p, 1], nearest[p, 2] = x, y, z


@njit(cache=True)
def _count_at(triangles, points, low, edge, counts, order, starts, winding):
    first, last = np.empty(2, np.int64), np.empty(2, np.int64)
    for m in range(len(triangles)):
        t = triangles[m]
        for a in range(2):
            begin, end = t[:, a].min() - low[a], t[:, a].max() - low[a]
            first[a] = np.int64(np.floor(max(begin / edge, 0.0)))
            last[a] = np.int64(np.floor(min(end / edge, counts[a] - 1.0)))
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                row = (i * counts[1] + j) * counts[2]
                for n in range(starts[row], starts[row + counts[2]]):
                    p = order[n]
                    side, height = vertical_hit(t, points[p, 0], points[p, 1])
                    if side and height < points[p, 2]:
                        winding[p] -= side
