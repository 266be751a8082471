# SPDX-License-Identifier: GPL-3.0-or-later
"""Balls as triangle meshes."""

from __future__ import annotations

from functools import cache

import numpy as np

from .mesh import Mesh

SUBDIVISIONS = 2
"""Of an icosahedron's triangles: 162 vertices, 320 triangles."""


def spheres(centres: np.ndarray, velocities: np.ndarray, radii: np.ndarray) -> Mesh:
    """Return balls, each moving as a whole, of exactly the volume that their radii say.

    centres, velocities : float32 ``(n, 3)``; radii : ``(n,)``, greater than 0
    """
    unit, faces = unit_sphere(SUBDIVISIONS)
    vertices = centres[:, None] + radii[:, None, None] * unit
    first = np.arange(len(radii), dtype=np.int32)[:, None, None] * np.int32(len(unit))
    return Mesh(
        vertices.reshape(-1, 3).astype(np.float32),
        (faces + first).reshape(-1, 3),
        np.repeat(velocities, len(unit), axis=0).astype(np.float32),
    )


@cache
def unit_sphere(subdivisions: int) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices ``(n, 3)`` and faces int32 ``(m, 3)`` of a ball of the volume 4 pi / 3."""
    from scipy.spatial import ConvexHull

    golden = (1 + np.sqrt(5)) / 2
    corners = np.array([(0, a, b * golden) for a in (-1, 1) for b in (-1, 1)])
    points = np.concatenate([np.roll(corners, turn, axis=1) for turn in range(3)])
    faces = ConvexHull(points).simplices
    for _ in range(subdivisions):
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
        points = np.concatenate([points, points[edges].mean(axis=1)])
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        faces = ConvexHull(points).simplices
    triangles = points[faces]
    outward = np.einsum(
        "ni,ni->n",
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]),
        triangles.mean(axis=1),
    )
    faces[outward < 0] = faces[outward < 0][:, ::-1]
    volume = np.abs(np.linalg.det(points[faces])).sum() / 6
    return points * np.cbrt(4 / 3 * np.pi / volume), faces.astype(np.int32)
