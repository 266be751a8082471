# SPDX-License-Identifier: GPL-3.0-or-later
"""Modelled meshes made closed: doubled vertices merged, holes covered."""

from __future__ import annotations

import numpy as np

from .mesh import directed_edges


def weld(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which vertices stay when those in the same place (to 1e-6 of the size) are merged.

    Returns their indices ``(k,)`` and, for each vertex, its place among them ``(n,)``.
    """
    step = max(float(np.ptp(vertices, axis=0).max()), 1e-30) * 1e-6
    keys = np.round((vertices - vertices.min(axis=0)) / step).astype(np.int64)
    # All three axes in one key, 21 bits each: sorts faster than rows.
    _, first, place = np.unique(
        (keys[:, 0] << 42) | (keys[:, 1] << 21) | keys[:, 2], return_index=True, return_inverse=True
    )
    return first, place


def welded_faces(faces: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return faces of merged vertices (see :func:`weld`), without those that have no area left."""
    faces = place[faces]
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]


def welded(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh with vertices in the same place (to 1e-6 of its size) merged."""
    first, place = weld(vertices)
    return vertices[first], welded_faces(faces, place)


def films(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return triangles ``(c, 3, 3)`` that close a mesh: a fan from the middle of every hole."""
    return spanned(vertices, *hole_edges(faces, len(vertices)))


def hole_edges(faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the edges of a mesh's holes: start, stop and the hole's number, ``(c,)`` each.

    A hole is a set of connected edges along which faces do not run equally often in both
    directions: edges of one face, and those of two faces of opposite orientation. With the films
    they do.

    count : of vertices
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    ends = directed_edges(faces).astype(np.int64)
    forward = ends[:, 0] < ends[:, 1]
    keys, place = np.unique(ends.min(1) * count + ends.max(1), return_inverse=True)
    net = np.bincount(place, np.where(forward, 1, -1)).astype(np.int64)
    start, stop = keys // count, keys % count
    swap = net < 0
    start, stop = np.where(swap, stop, start), np.where(swap, start, stop)
    start, stop = np.repeat(start, abs(net)), np.repeat(stop, abs(net))
    links = coo_matrix((np.ones(len(start)), (start, stop)), shape=(count, count))
    _, hole = connected_components(links, directed=False)
    return start, stop, hole[start]


def spanned(
    vertices: np.ndarray, start: np.ndarray, stop: np.ndarray, hole: np.ndarray
) -> np.ndarray:
    """Return the films ``(c, 3, 3)`` over holes with these edges (see :func:`hole_edges`)."""
    if not len(start):
        return np.zeros((0, 3, 3))
    count = len(vertices)
    weight = np.bincount(hole, minlength=count)
    edges = (vertices[start] + vertices[stop]) / 2
    sums = np.stack([np.bincount(hole, edges[:, a], count) for a in range(3)], axis=1)
    middle = (sums / np.maximum(weight, 1)[:, None])[hole]
    return np.stack([vertices[stop], vertices[start], middle], axis=1)
