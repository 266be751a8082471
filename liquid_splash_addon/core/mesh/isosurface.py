# SPDX-License-Identifier: GPL-3.0-or-later
"""Marching cubes in slabs: scikit-image holds Python's lock for as long as it is at work."""

from __future__ import annotations

import numpy as np

LAYERS = 32
"""Of cubes in a slab: Blender's interface waits for one slab, not for the whole surface."""


def isosurface(level: np.ndarray, iso: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices, float32 ``(n, 3)``, and faces ``(m, 3)`` where ``level`` is ``iso``.

    By the method of Lewiner et al. (2003). Normals point to where ``level`` is larger. Vertices
    are array indices.

    level : float32 ``(X, Y, Z)``, at least 2 along each axis. Raises ValueError where ``iso`` is
    outside its values.
    """
    if not level.min() <= iso <= level.max():
        raise ValueError("The level has no such value")
    starts = range(0, level.shape[0] - 1, LAYERS)
    slabs = [slab(level, iso, start) for start in starts]
    points = np.concatenate([points for points, _ in slabs])
    counts = np.cumsum([0, *(len(points) for points, _ in slabs)])
    faces = np.concatenate([f + count for (_, f), count in zip(slabs, counts, strict=False)])
    if len(starts) == 1:
        return points, faces
    same = np.arange(len(points))
    for n in range(1, len(slabs)):
        above = np.arange(counts[n], counts[n + 1])
        below = np.arange(counts[n - 1], counts[n])
        above, below = (part[points[part, 0] == starts[n]] for part in (above, below))
        if not pair(points, above, below, same):
            return whole(level, iso)
    kept = same == np.arange(len(same))
    return points[kept], (np.cumsum(kept) - 1)[same][faces].astype(np.int32)


def slab(level: np.ndarray, iso: float, start: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices and faces of the cubes from ``start`` on; none where there are none."""
    part = level[start : start + LAYERS + 1]
    if part.min() >= iso or part.max() <= iso:
        return np.zeros((0, 3), dtype=np.float32), np.zeros((0, 3), dtype=np.int32)
    points, faces = whole(part, iso)
    return points + np.array([start, 0, 0], dtype=np.float32), faces


def whole(level: np.ndarray, iso: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces as scikit-image makes them in one go."""
    from skimage.measure import marching_cubes

    # "descent" because what is inside lies below the level: normals then point outward.
    points, faces, _, _ = marching_cubes(level, iso, gradient_direction="descent")
    return points, faces


def pair(points: np.ndarray, above: np.ndarray, below: np.ndarray, same: np.ndarray) -> bool:
    """Enter into ``same`` which vertices of one slab are those of the slab before.

    Both compute a vertex on their common side from the same values, so that they agree to the last
    bit. Returns False where that does not tell which is which: a value equal to the isovalue puts
    several vertices at one place.
    """
    if len(above) != len(below):
        return False
    order = [part[np.lexsort(points[part].T)] for part in (above, below)]
    first, second = (points[part, 1:] for part in order)
    same[order[0]] = order[1]
    twice = (first[1:] == first[:-1]).all(axis=1).any()
    return bool((first == second).all() and not twice)
