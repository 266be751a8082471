# SPDX-License-Identifier: GPL-3.0-or-later
"""Local thickness and clearance: how far a surface can move before it meets itself."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from ..numeric.cell_list import cell_list
from ..numeric.threads import in_parts

MOST_VERTEX_BOXES = 3e7
"""Boxes with edges of ``reach`` that the mesh's bounding box may hold."""

FINER = 2
"""Edges of the boxes that are searched fit so often into ``reach``: most balls are much smaller."""


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
    return _balls(vertices, normals, reach, True)


def half_thickness(vertices: np.ndarray, normals: np.ndarray, reach: float) -> np.ndarray:
    """Return the first result of :func:`thickness_and_clearance`, in half the time or less."""
    return _balls(vertices, normals, reach, False)[0]


def _balls(
    vertices: np.ndarray, normals: np.ndarray, reach: float, both: bool
) -> tuple[np.ndarray, np.ndarray]:
    inward = np.full(len(vertices), reach / 2, dtype=np.float32)
    outward = inward.copy()
    if len(vertices):
        points = ((vertices - vertices.min(axis=0)) / reach).astype(np.float32)
        boxes = np.prod(points.max(axis=0).astype(np.float64) + 1)
        if boxes > MOST_VERTEX_BOXES:
            raise ValueError("the mesh is too large for a search this fine")
        finer = FINER if boxes * FINER**3 < MOST_VERTEX_BOXES else 1
        size = tuple(int(n) + 1 for n in finer * points.max(axis=0))
        order, first = cell_list(points, np.zeros(3, dtype=np.float32), np.float32(1 / finer), size)
        held = (
            points, points[order], normals.astype(np.float32), first, size, *_nearest_first(finer),
            np.float32(1 / finer), np.float32(reach), both,
        )  # fmt: skip
        in_parts(len(points), lambda a, b: _touching_balls(a, b, *held, inward, outward))
    return inward, outward


def _nearest_first(finer: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the offsets of the boxes around one, nearest first, and how far they are at least.

    int32 ``(m, 3)`` and float32 ``(m,)``, in reaches.
    """
    steps = np.arange(-finer, finer + 1, dtype=np.int32)
    offsets = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    away = np.sqrt((np.maximum(np.abs(offsets) - 1, 0) ** 2).sum(axis=1)) / finer
    # Of those that touch the box itself, it comes first, then those beside its faces.
    order = np.lexsort((np.abs(offsets).sum(axis=1), away))
    return offsets[order], away[order].astype(np.float32)


@njit(cache=True, fastmath=True)
def _touching_balls(
    start, stop, points, sorted_points, normals, first, size, offsets, least, side, reach, both,
    inward, outward,
):  # fmt: skip
    one, half, tiny = np.float32(1), np.float32(0.5), np.float32(1e-12)
    for v in range(start, stop):
        x, y, z = points[v, 0], points[v, 1], points[v, 2]
        nx, ny, nz = normals[v, 0], normals[v, 1], normals[v, 2]
        # Inverse diameters of the balls, in reaches; the normal side is outside. Points can only
        # make a ball smaller if they lie within it: boxes that it does not meet are left out.
        inner, outer = one, one
        i, j, k = int(x / side), int(y / side), int(z / side)
        for n in range(len(offsets)):
            if least[n] * min(inner, outer if both else inner) >= one:
                break
            a, b, c = i + offsets[n, 0], j + offsets[n, 1], k + offsets[n, 2]
            if min(a, b, c) < 0 or a >= size[0] or b >= size[1] or c >= size[2]:
                continue
            r = half / inner
            is_near = _meets(x - r * nx, y - r * ny, z - r * nz, r, a, b, c, side)
            if both and not is_near:
                r = half / outer
                is_near = _meets(x + r * nx, y + r * ny, z + r * nz, r, a, b, c, side)
            if not is_near:
                continue
            box = (a * size[1] + b) * size[2] + c
            for place in range(first[box], first[box + 1]):
                dx = sorted_points[place, 0] - x
                dy = sorted_points[place, 1] - y
                dz = sorted_points[place, 2] - z
                square = dx * dx + dy * dy + dz * dz
                if square < one:
                    # The ball of diameter d at the normal n touches p where |p|^2 = d p.n.
                    high = (dx * nx + dy * ny + dz * nz) / max(square, tiny)
                    outer = max(outer, high)
                    inner = max(inner, -high)
        inward[v] = half * reach / inner
        if both:
            outward[v] = half * reach / outer


@njit(cache=True, fastmath=True, inline="always")
def _meets(x, y, z, radius, a, b, c, side):
    """Return whether a ball meets a box, whose number along each axis is given."""
    # A little larger, so that rounding leaves out nothing.
    radius *= np.float32(1.0001)
    dx = max(a * side - x, x - (a + 1) * side, np.float32(0))
    dy = max(b * side - y, y - (b + 1) * side, np.float32(0))
    dz = max(c * side - z, z - (c + 1) * side, np.float32(0))
    return dx * dx + dy * dy + dz * dz <= radius * radius
