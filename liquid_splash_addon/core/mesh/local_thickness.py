# SPDX-License-Identifier: GPL-3.0-or-later
"""Local thickness and clearance: how far a surface can move before it meets itself."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from ..numeric.cell_list import cell_list
from ..numeric.threads import in_parts

MOST_VERTEX_BOXES = 3e7
"""Boxes with edges of ``reach`` that the mesh's bounding box may hold."""


def thickness_and_clearance(
    vertices: np.ndarray, normals: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return half the local thickness and half the clearance at every vertex, float32 ``(n,)``.

    Each is the radius of the largest ball that touches the surface at the vertex, on the inner or
    outer side, and holds no other vertex within ``reach``: half the thickness of a sheet or half
    the gap between two, or the radius of curvature, whichever is smaller; at most ``reach / 2``.
    A vertex that moves by less than that meets no other part of the surface.

    vertices : ``(n, 3)``, no farther apart than the details that count; normals : unit, outward;
    reach : in the vertices' unit. Raises ValueError for a mesh of too many boxes.
    """
    inward = np.full(len(vertices), reach / 2, dtype=np.float32)
    outward = inward.copy()
    if len(vertices):
        points = ((vertices - vertices.min(axis=0)) / reach).astype(np.float32)
        size = tuple(int(n) + 1 for n in points.max(axis=0))
        if np.prod(size, dtype=np.float64) > MOST_VERTEX_BOXES:
            raise ValueError("the mesh is too large for a search this fine")
        order, first = cell_list(points, np.zeros(3, dtype=np.float32), np.float32(1), size)
        held = (points, points[order], normals, first, size, np.float32(reach))
        in_parts(len(points), lambda a, b: _touching_balls(a, b, *held, inward, outward))
    return inward, outward


@njit(cache=True, fastmath=True)
def _touching_balls(start, stop, points, sorted_points, normals, first, size, reach, *found):
    inward, outward = found
    one = np.float32(1)
    for v in range(start, stop):
        x, y, z = points[v, 0], points[v, 1], points[v, 2]
        nx, ny, nz = normals[v, 0], normals[v, 1], normals[v, 2]
        # Inverse diameters of the balls, in reaches; the normal side is outside.
        inner, outer = one, one
        i, j, k = int(x), int(y), int(z)
        for a in range(max(i - 1, 0), min(i + 2, size[0])):
            for b in range(max(j - 1, 0), min(j + 2, size[1])):
                row = (a * size[1] + b) * size[2]
                begin = first[row + max(k - 1, 0)]
                end = first[row + min(k + 2, size[2])]
                for place in range(begin, end):
                    dx = sorted_points[place, 0] - x
                    dy = sorted_points[place, 1] - y
                    dz = sorted_points[place, 2] - z
                    square = dx * dx + dy * dy + dz * dz
                    if square < one:
                        # The ball of diameter d at the normal n touches p where |p|^2 = d p.n.
                        high = (dx * nx + dy * ny + dz * nz) / max(square, np.float32(1e-12))
                        outer = max(outer, high)
                        inner = max(inner, -high)
        inward[v] = np.float32(0.5) * reach / inner
        outward[v] = np.float32(0.5) * reach / outer
