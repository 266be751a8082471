# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths, areas and normals of a triangle mesh."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, inline="always")
def squared_length(a, b, points):
    """Return the squared distance of two vertices."""
    x, y, z = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1], points[a, 2] - points[b, 2]
    return x * x + y * y + z * z


@njit(cache=True, inline="always")
def cross_edges(a, b, c, points):
    """Return twice the area vector of the triangle abc."""
    ux, vx = points[b, 0] - points[a, 0], points[c, 0] - points[a, 0]
    uy, vy = points[b, 1] - points[a, 1], points[c, 1] - points[a, 1]
    uz, vz = points[b, 2] - points[a, 2], points[c, 2] - points[a, 2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return unit normals ``(n, 3)``, float32, the mean of the faces' by area."""
    normals = np.zeros((len(vertices), 3), dtype=np.float64)
    _add_normals(vertices.astype(np.float64), faces, normals)
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    return (normals / np.maximum(size, 1e-300)).astype(np.float32)


@njit(cache=True)
def _add_normals(points, faces, normals):
    for f in range(len(faces)):
        x, y, z = cross_edges(faces[f, 0], faces[f, 1], faces[f, 2], points)
        for k in range(3):
            normals[faces[f, k], 0] += x
            normals[faces[f, k], 1] += y
            normals[faces[f, k], 2] += z


def face_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the faces' areas ``(m,)``, float64."""
    a, b, c = (vertices[faces[:, k]].astype(np.float64) for k in range(3))
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def enclosed(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Return the volume inside a closed mesh."""
    a, b, c = (vertices[faces[:, k]].astype(np.float64) for k in range(3))
    return float(np.einsum("ij,ij->", np.cross(a, b), c) / 6)
