# SPDX-License-Identifier: GPL-3.0-or-later
"""The finished mesh and the obstacles: no vertex inside one, no triangle turned over."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..numeric.triangles import face_normals
from .obstacles import SHELL_CELLS, Obstacle, depth_of_points

FIRST_REACH = 1.5
"""Depth in cells up to which the way out of an obstacle is searched at first: few lie deeper."""

DEEPEST = 100.0
"""Depth in cells up to which it is searched at all."""

DEPTH_TOLERANCE = 1e-3
"""Cells by which a vertex may lie too deep."""

MOST_UNFOLDINGS = 8
"""Most attempts to unfold triangles that were pushed together."""

MOST_PASSES = 30
"""Most passes over several obstacles: the way out of one may lead into another."""


def push_out(
    vertices: np.ndarray,
    faces: np.ndarray,
    obstacles: Sequence[Obstacle],
    cell: float,
    offset: float = 0.0,
) -> np.ndarray:
    """Return the vertices ``(n, 3)`` of a mesh, those in an obstacle moved to its surface.

    Vertices move the shortest way. Triangles that this turns over are spread along the obstacle
    again.

    vertices, obstacles : in the same unit; cell : edge of a cell in it; offset : cells of air
    around the obstacles.
    """
    before = vertices.astype(np.float64)
    moved = before.copy()
    touched = leave(moved, np.arange(len(moved)), obstacles, cell, offset)
    near = faces[np.isin(faces, touched).any(axis=1)]
    facing = face_normals(before, near)
    for _ in range(MOST_UNFOLDINGS):
        turned = (face_normals(moved, near) * facing).sum(axis=1) < 0
        if not turned.any():
            break
        spread = np.unique(near[turned])
        relax(moved, near, spread)
        leave(moved, spread, obstacles, cell, offset)
    return moved.astype(vertices.dtype)


def leave(
    points: np.ndarray,
    chosen: np.ndarray,
    obstacles: Sequence[Obstacle],
    cell: float,
    offset: float,
) -> np.ndarray:
    """Move the ``chosen`` of the points ``(n, 3)`` out of the obstacles, in place.

    Returns the indices of those that moved.
    """
    every = chosen[:0]
    for _ in range(MOST_PASSES if len(obstacles) > 1 else 1):
        moved = [leave_one(points, chosen, obstacle, cell, offset) for obstacle in obstacles]
        chosen = np.unique(np.concatenate([every[:0], *moved]))
        every = np.union1d(every, chosen)
        if not len(chosen):
            break
    return every


def leave_one(
    points: np.ndarray, chosen: np.ndarray, obstacle: Obstacle, cell: float, offset: float
) -> np.ndarray:
    """Move the ``chosen`` points out of one obstacle; see :func:`leave`."""
    reach = FIRST_REACH + offset
    distance, nearest = depth_of_points(obstacle, points[chosen], cell, reach)
    inner = distance < offset - DEPTH_TOLERANCE
    chosen, distance, nearest = chosen[inner], distance[inner], nearest[inner]
    while (deep := distance <= -reach).any() and reach < DEEPEST:
        reach *= 4
        distance[deep], nearest[deep] = depth_of_points(obstacle, points[chosen[deep]], cell, reach)
    away = points[chosen] - nearest
    length = np.maximum(np.linalg.norm(away, axis=1), 1e-12 * cell)
    side = distance + (0.0 if obstacle.solid else SHELL_CELLS)
    step = np.where(side < 0, -1.0, 1.0) * (offset - distance) * cell / length
    points[chosen] += step[:, None] * away
    return chosen


def relax(vertices: np.ndarray, faces: np.ndarray, chosen: np.ndarray) -> None:
    """Move the ``chosen`` vertices to the middle of their neighbours, in place."""
    ends = np.concatenate([faces, np.roll(faces, 1, axis=1), np.roll(faces, 2, axis=1)])
    own, other = ends[:, [0, 0]].ravel(), ends[:, 1:].ravel()
    count = np.maximum(np.bincount(own, minlength=len(vertices)), 1)
    sums = [np.bincount(own, vertices[other, axis], len(vertices)) for axis in range(3)]
    vertices[chosen] = (np.stack(sums, axis=1) / count[:, None])[chosen]
