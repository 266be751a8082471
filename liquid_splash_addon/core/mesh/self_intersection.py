# SPDX-License-Identifier: GPL-3.0-or-later
"""Self-intersections: faces that cut through each other, found and undone."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from ..numeric.cell_list import counting_sort
from ..numeric.threads import in_parts
from ..numeric.triangles import face_normals

BOX_SIZE = 1.4
"""Edge of the boxes in which nearby faces are found, over the faces' mean size."""

MOST_FACE_BOXES = 1e7
"""Boxes of 4 bytes each; they are made larger if the mesh is far wider than its faces."""

ALIKE_COSINE = 0.8
"""Cosine above which faces are taken to look the same way and are not compared, which saves two
thirds of the time: sheets that pass through each other face opposite ways, and a fold turns its
faces over."""

MOST_RETREATS = 12
"""Times that :func:`take_back` shortens moves and looks again."""

KEPT_SHARE = 0.6
"""Share of its move that a vertex at a crossing keeps each time."""


def take_back(before: np.ndarray, moved: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return ``moved`` vertices ``(n, 3)``, nearer to ``before`` wherever faces would cross.

    Where a sheet or a gap is thinner than the moves of its two sides, they pass through each
    other. Such places are few: only faces that cross, and their neighbours, go back step by step.

    before : ``(n, 3)``, without crossing faces; faces : int ``(m, 3)``.
    """
    share = np.ones((len(moved), 1))
    there, near = moved, faces
    for _ in range(MOST_RETREATS):
        crossed = crossing_faces(there, near)
        if not crossed.any():
            break
        touched = np.zeros(len(moved), dtype=bool)
        touched[near[crossed]] = True
        touched[faces[_touching(faces, touched)]] = True
        share[touched] *= KEPT_SHARE
        if there is moved:
            there = before + share * (moved - before)
        else:
            there[touched] = before[touched] + share[touched] * (moved[touched] - before[touched])
        # Elsewhere nothing crossed, and nothing has moved since.
        near = faces[faces_beside(there, faces, _touching(faces, touched))]
    return there


@njit(cache=True)
def _touching(faces, touched):
    """Return which faces have a corner that is touched, bool ``(m,)``."""
    found = np.empty(len(faces), dtype=np.bool_)
    for f in range(len(faces)):
        found[f] = touched[faces[f, 0]] or touched[faces[f, 1]] or touched[faces[f, 2]]
    return found


def faces_beside(vertices: np.ndarray, faces: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return which faces may meet one of the chosen faces, theirs too, bool ``(m,)`` each."""
    _, bounds, scale, size = in_boxes(vertices, faces)
    return np.asarray(_beside(bounds, chosen, scale, size))


def in_boxes(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.float32, tuple[int, ...]]:
    """Return what lays faces out in boxes: points from the lowest corner on, float64 ``(n, 3)``,
    the faces' bounds, see :func:`_bounds`, boxes per unit of length, and boxes along each axis.
    """
    points, extent = _from_lowest(vertices)
    bounds, mean = _bounds(points, faces)
    side = max(BOX_SIZE * mean, float(np.cbrt(np.prod(extent + mean) / MOST_FACE_BOXES)))
    return points, bounds, np.float32(1 / side), tuple(int(n) + 1 for n in extent / side)


def crossing_faces(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return which faces cut through another one, bool ``(m,)``.

    Faces with a common edge do not count, as they could only overlap. Nor do faces that look the
    same way, see ALIKE_COSINE.

    vertices : ``(n, 3)``; faces : int ``(m, 3)``, of similar sizes.
    """
    crossed = np.zeros(len(faces), dtype=bool)
    if len(faces):
        faces = np.ascontiguousarray(faces, dtype=np.int32)
        points, bounds, scale, size = in_boxes(vertices, faces)
        keys, owners = _boxes(bounds, scale, size)
        order, first = counting_sort(keys, size[0] * size[1] * size[2])
        inside = owners[order]
        normals = face_normals(points, faces).astype(np.float32)
        held = points, faces, bounds, normals, first, inside

        def find(begin: int, end: int) -> None:
            # Boxes of about as many faces for each thread. What they write is only ever True.
            ends = np.searchsorted(first[:-1], np.array([begin, end], dtype=first.dtype))
            _find(ends[0], ends[1], *held, crossed)

        in_parts(len(inside), find)
    return crossed


@njit(cache=True)
def _from_lowest(vertices):
    """Return points from their lowest corner on, float64 ``(n, 3)``, and the highest one."""
    points = vertices.astype(np.float64)
    low, extent = np.full(3, np.inf), np.zeros(3)
    for v in range(len(points)):
        for n in range(3):
            low[n] = min(low[n], points[v, n])
    for v in range(len(points)):
        for n in range(3):
            points[v, n] -= low[n]
            extent[n] = max(extent[n], points[v, n])
    return points, extent


@njit(cache=True)
def _bounds(points, faces):
    """Return each face's lowest and highest coordinates, float32 ``(m, 6)``, and the mean size."""
    bounds = np.empty((len(faces), 6), dtype=np.float32)
    total = 0.0
    for f in range(len(faces)):
        most = np.float32(0)
        for n in range(3):
            a, b, c = points[faces[f, 0], n], points[faces[f, 1], n], points[faces[f, 2], n]
            bounds[f, n], bounds[f, 3 + n] = min(a, b, c), max(a, b, c)
            most = max(most, bounds[f, 3 + n] - bounds[f, n])
        total += float(most)
    return bounds, total / len(faces)


@njit(cache=True)
def _boxes(bounds, scale, size):
    """Return the number of every box that a face's bounds meet, and that face, int32 each.

    scale : boxes to a unit of length; size : boxes along each axis.
    """
    total = 0
    for f in range(len(bounds)):
        count = 1
        for n in range(3):
            count *= int(scale * bounds[f, 3 + n]) - int(scale * bounds[f, n]) + 1
        total += count
    keys, owners = np.empty(total, dtype=np.int32), np.empty(total, dtype=np.int32)
    total = 0
    for f in range(len(bounds)):
        for i in range(int(scale * bounds[f, 0]), int(scale * bounds[f, 3]) + 1):
            for j in range(int(scale * bounds[f, 1]), int(scale * bounds[f, 4]) + 1):
                for k in range(int(scale * bounds[f, 2]), int(scale * bounds[f, 5]) + 1):
                    keys[total] = (i * size[1] + j) * size[2] + k
                    owners[total] = f
                    total += 1
    return keys, owners


@njit(cache=True)
def _beside(bounds, chosen, scale, size):
    """Return which faces' bounds share a box with those of a chosen face, bool ``(m,)``."""
    taken = np.zeros((size[0], size[1], size[2]), dtype=np.bool_)
    found = chosen.copy()
    for marks in (True, False):
        for f in range(len(bounds)):
            if chosen[f] != marks:
                continue
            for i in range(int(scale * bounds[f, 0]), int(scale * bounds[f, 3]) + 1):
                for j in range(int(scale * bounds[f, 1]), int(scale * bounds[f, 4]) + 1):
                    for k in range(int(scale * bounds[f, 2]), int(scale * bounds[f, 5]) + 1):
                        if marks:
                            taken[i, j, k] = True
                        elif taken[i, j, k]:
                            found[f] = True
    return found


@njit(cache=True)
def _find(start, stop, points, faces, bounds, normals, first, inside, crossed):
    alike = np.float32(ALIKE_COSINE)
    for box in range(start, stop):
        for p in range(first[box], first[box + 1]):
            f = inside[p]
            nx, ny, nz = normals[f, 0], normals[f, 1], normals[f, 2]
            x0, y0, z0 = bounds[f, 0], bounds[f, 1], bounds[f, 2]
            x1, y1, z1 = bounds[f, 3], bounds[f, 4], bounds[f, 5]
            for q in range(p + 1, first[box + 1]):
                g = inside[q]
                if nx * normals[g, 0] + ny * normals[g, 1] + nz * normals[g, 2] > alike:
                    continue
                if bounds[g, 0] > x1 or bounds[g, 3] < x0 or bounds[g, 1] > y1:
                    continue
                if bounds[g, 4] < y0 or bounds[g, 2] > z1 or bounds[g, 5] < z0:
                    continue
                if _cross(f, g, points, faces, normals):
                    crossed[f] = True
                    crossed[g] = True


@njit(cache=True)
def _cross(f, g, points, faces, normals):
    """Return whether two faces with at most one common vertex cut through each other."""
    a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
    d, e, h = faces[g, 0], faces[g, 1], faces[g, 2]
    # A common vertex comes first in both.
    if b == d or b == e or b == h:
        a, b, c = b, c, a
    elif c == d or c == e or c == h:
        a, b, c = c, a, b
    if a == e:
        d, e, h = e, h, d
    elif a == h:
        d, e, h = h, d, e
    if b == e or b == h or c == e or c == h:
        return False
    apart = a != d
    if _one_side(f, a, d, e, h, apart, points, normals):
        return False
    if _one_side(g, d, a, b, c, apart, points, normals):
        return False
    if _pierces(b, c, d, e, h, points) or _pierces(e, h, a, b, c, points):
        return True
    return apart and (
        _pierces(a, b, d, e, h, points)
        or _pierces(c, a, d, e, h, points)
        or _pierces(d, e, a, b, c, points)
        or _pierces(h, d, a, b, c, points)
    )


@njit(cache=True, inline="always")
def _one_side(f, a, d, e, h, apart, points, normals):
    """Return whether e and h, and d unless it is a (``apart``), lie on one side of face f at a."""
    x, y, z = normals[f, 0], normals[f, 1], normals[f, 2]
    base = x * points[a, 0] + y * points[a, 1] + z * points[a, 2]
    second = x * points[e, 0] + y * points[e, 1] + z * points[e, 2] - base
    third = x * points[h, 0] + y * points[h, 1] + z * points[h, 2] - base
    if second * third <= 0:
        return False
    return not apart or second * (x * points[d, 0] + y * points[d, 1] + z * points[d, 2] - base) > 0


@njit(cache=True)
def _pierces(a, b, d, e, h, points):
    """Return whether the edge ab passes through the face deh."""
    if _volume(a, d, e, h, points) * _volume(b, d, e, h, points) >= 0:
        return False
    u, v, w = _volume(a, b, d, e, points), _volume(a, b, e, h, points), _volume(a, b, h, d, points)
    return (u > 0 and v > 0 and w > 0) or (u < 0 and v < 0 and w < 0)


@njit(cache=True, inline="always")
def _volume(a, b, c, d, points):
    """Return six times the signed volume of the tetrahedron abcd."""
    x, y, z = points[a, 0], points[a, 1], points[a, 2]
    bx, by, bz = points[b, 0] - x, points[b, 1] - y, points[b, 2] - z
    cx, cy, cz = points[c, 0] - x, points[c, 1] - y, points[c, 2] - z
    dx, dy, dz = points[d, 0] - x, points[d, 1] - y, points[d, 2] - z
    return bx * (cy * dz - cz * dy) + by * (cz * dx - cx * dz) + bz * (cx * dy - cy * dx)
