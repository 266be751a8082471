# SPDX-License-Identifier: GPL-3.0-or-later
"""The edges of triangles, each once, as a renderer's or a modeller's mesh stores them."""

from __future__ import annotations

import numpy as np

from ..compiling import njit


def unique_edges(faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges of triangles, and which edge begins at each of their corners.

    Linear in the number of faces, as the corners are sorted into buckets by their lower vertex.

    faces : int32 ``(m, 3)``; count : of the vertices that they name
    Returns int32 ``(e, 2)``, the lower vertex first, and int32 ``(m, 3)``.
    """
    edges, of_corners, used = bucketed(np.ascontiguousarray(faces, dtype=np.int32), count)
    return edges[:used], of_corners


@njit(cache=True)
def bucketed(faces, count):
    """Return the edges in a longer table, the edge of each corner, and how many edges there are."""
    corners = 3 * len(faces)
    begins = np.zeros(count + 2, dtype=np.int64)
    for face in range(len(faces)):
        for corner in range(3):
            begins[min(faces[face, corner], faces[face, corner - 2]) + 2] += 1
    begins = np.cumsum(begins)
    # begins[v + 1] is where bucket v is filled on: in the end it is where the next one begins.
    upper = np.empty(corners, dtype=np.int32)
    places = np.empty(corners, dtype=np.int64)
    for face in range(len(faces)):
        for corner in range(3):
            first, second = faces[face, corner], faces[face, corner - 2]
            at = begins[min(first, second) + 1]
            begins[min(first, second) + 1] += 1
            upper[at], places[at] = max(first, second), 3 * face + corner
    edges = np.empty((corners, 2), dtype=np.int32)
    of_corners = np.empty(corners, dtype=np.int32)
    used = 0
    for vertex in range(count):
        oldest = used
        for at in range(begins[vertex], begins[vertex + 1]):
            edge = oldest
            while edge < used and edges[edge, 1] != upper[at]:
                edge += 1
            if edge == used:
                edges[edge, 0], edges[edge, 1] = vertex, upper[at]
                used += 1
            of_corners[places[at]] = edge
    return edges, of_corners.reshape(-1, 3), used
