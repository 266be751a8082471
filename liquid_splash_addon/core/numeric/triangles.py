# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths, normals, areas and volumes of triangles: points ``(n, 3)``, corners by number."""

from __future__ import annotations

import numpy as np

from ..compiling import njit


@njit(cache=True, inline="always")
def squared_length(a, b, points):
    """Return the squared distance between the points numbered a and b."""
    x, y, z = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1], points[a, 2] - points[b, 2]
    return x * x + y * y + z * z


@njit(cache=True, inline="always")
def cross_edges(a, b, c, points):
    """Return the normal (x, y, z) of the triangle abc, as long as twice its area."""
    ux, vx = points[b, 0] - points[a, 0], points[c, 0] - points[a, 0]
    uy, vy = points[b, 1] - points[a, 1], points[c, 1] - points[a, 1]
    uz, vz = points[b, 2] - points[a, 2], points[c, 2] - points[a, 2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


def face_normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the faces' unit normals, float64 ``(m, 3)``; 0 for a face without area."""
    normals = np.empty((len(faces), 3))
    _face_normals(np.asarray(points, dtype=np.float64), faces, normals)
    return normals


@njit(cache=True)
def _face_normals(points, faces, normals):
    for f in range(len(faces)):
        x, y, z = cross_edges(faces[f, 0], faces[f, 1], faces[f, 2], points)
        size = max(np.sqrt(x * x + y * y + z * z), 1e-30)
        normals[f, 0], normals[f, 1], normals[f, 2] = x / size, y / size, z / size


def vertex_normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return unit normals at the points, float32 ``(n, 3)``: the faces' mean, weighted by area."""
    normals = np.zeros((len(points), 3), dtype=np.float64)
    _add_normals(points.astype(np.float64), faces, normals)
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


def face_areas(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the faces' areas, float64 ``(m,)``, in the points' unit squared."""
    return triangle_areas(points[faces])


def triangle_areas(triangles: np.ndarray) -> np.ndarray:
    """Return the areas, float64 ``(m,)``, of triangles ``(m, 3, 3)``: triangle, corner, axis."""
    areas = np.empty(len(triangles))
    _areas(np.asarray(triangles, dtype=np.float64), areas)
    return areas


@njit(cache=True)
def _areas(triangles, areas):
    for m in range(len(triangles)):
        x, y, z = cross_edges(0, 1, 2, triangles[m])
        areas[m] = np.sqrt(x * x + y * y + z * z) / 2


def signed_volumes(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the volumes ``(m,)`` of the tetrahedra from the origin to each face, float64.

    Positive where a face looks away from the origin: those of a closed mesh with outward
    normals sum to the volume inside it (divergence theorem).
    """
    volumes = np.empty(len(faces))
    _signed_volumes(np.asarray(points, dtype=np.float64), faces, volumes)
    return volumes


@njit(cache=True)
def _signed_volumes(points, faces, volumes):
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        x = points[a, 1] * points[b, 2] - points[a, 2] * points[b, 1]
        y = points[a, 2] * points[b, 0] - points[a, 0] * points[b, 2]
        z = points[a, 0] * points[b, 1] - points[a, 1] * points[b, 0]
        volumes[f] = (x * points[c, 0] + y * points[c, 1] + z * points[c, 2]) / 6


def enclosed_volume(points: np.ndarray, faces: np.ndarray) -> float:
    """Return the volume inside a closed mesh, in the points' unit cubed."""
    return float(signed_volumes(points, faces).sum())
