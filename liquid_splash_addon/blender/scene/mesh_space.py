# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a splash's liquid is in its mesh: Blender's own tools move meshes within their objects.

Liquid lives in the splash's *drawing space*; its mesh is written there. *Apply Transform*, *Set
Origin* and moving it in Edit Mode move the vertices alone. A few of them are kept as they were
written: from where they are now follows the mesh's *space*, the transform from drawing space to the
mesh, and all that reads or writes the liquid goes by it.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from . import places

KEPT = 24
"""Vertices that are kept."""

UNMOVED = 1e-6
"""Share of the kept vertices' extent by which they may be off where nothing has moved them."""

FITS = 2e-4
"""Share by which they may be off where a transform has: sculpted ones are off by more."""

LEAST = 0.6
"""Share of them that must follow it."""


def space_of(data: bpy.types.Mesh) -> np.ndarray:
    """Return the transform from drawing space to a mesh, float64 ``(4, 4)``."""
    record = data.splash_liquid
    written = matrix_from(record.space)
    table = np.array(record.kept.split(), dtype=np.float64).reshape(-1, 4)
    if not len(table) or table[:, 0].max() >= len(data.vertices) or data.is_editmode:
        return written
    now = positions(data, table[:, 0].astype(int))
    return moved_by(table[:, 1:], now) @ written


def remember(data: bpy.types.Mesh, space: np.ndarray, vertices: np.ndarray) -> None:
    """Keep the space that a mesh is written in, and a few of its vertices ``(n, 3)``."""
    record = data.splash_liquid
    record.space = "" if np.array_equal(space, np.eye(4)) else text_of(space.ravel())
    chosen = spread(vertices)
    table = np.column_stack([chosen, vertices[chosen]]) if len(chosen) else np.zeros((0, 4))
    record.kept = text_of(table.ravel())


def moved_by(before: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Return the affine transform that has moved most of the points ``(n, 3)``, ``(4, 4)``.

    The identity where there is none: somebody has edited them.
    """
    size = max(float(np.ptp(before, axis=0).max()), 1e-30)
    away = np.linalg.norm(now - before, axis=1)
    # Single precision: far from the origin, points are known less well.
    near = UNMOVED * size + 4e-7 * float(np.abs(before).max())
    if np.count_nonzero(away <= near) >= LEAST * len(before):
        return np.eye(4)
    follows = np.ones(len(before), dtype=bool)
    for _ in range(4):
        if np.count_nonzero(follows) < max(LEAST * len(before), 4):
            return np.eye(4)
        middle = before[follows].mean(axis=0)
        table = np.column_stack([before - middle, np.ones(len(before))])
        if np.linalg.matrix_rank(table[follows], tol=1e-6 * size) < 4:
            return np.eye(4)
        found = np.linalg.lstsq(table[follows], now[follows], rcond=None)[0]
        errors = np.linalg.norm(table @ found - now, axis=1)
        extent = max(float(np.ptp(now[follows], axis=0).max()), 1e-30)
        limit = FITS * extent + 4e-7 * float(np.abs(now).max())
        if errors[follows].max() <= limit:
            result = np.eye(4)
            result[:3, :3] = found[:3].T
            result[:3, 3] = found[3] - found[:3].T @ middle
            return result if abs(np.linalg.det(result[:3, :3])) > 0 else np.eye(4)
        follows = errors <= max(float(np.median(errors)), limit)
    return np.eye(4)


def spread(vertices: np.ndarray) -> np.ndarray:
    """Return the places of a few vertices that lie far apart: the outermost, and some between."""
    if not len(vertices):
        return np.zeros(0, dtype=np.int64)
    ends = [*vertices.argmin(axis=0), *vertices.argmax(axis=0)]
    between = np.linspace(0, len(vertices) - 1, KEPT - len(ends)).astype(np.int64)
    return np.unique([*ends, *between])


def positions(data: bpy.types.Mesh, chosen: np.ndarray) -> np.ndarray:
    """Return some vertices, float64 ``(n, 3)``."""
    values = data.attributes["position"].data
    return np.array([values[int(number)].vector for number in chosen], dtype=np.float64)


def text_of(values: Any) -> str:
    """Return numbers as text, exactly: Blender's number properties are single precision."""
    return " ".join(repr(float(value)) for value in values)


def matrix_from(text: str) -> np.ndarray:
    """Return the ``(4, 4)`` matrix of such a text; the identity of none."""
    if not text:
        return np.eye(4)
    return np.array(text.split(), dtype=np.float64).reshape(4, 4)


def liquid_matrix(item: bpy.types.Object) -> Matrix:
    """Return the transform from the drawing space of a splash or a model to the world."""
    return combined(places.world_matrix(item), space_of(item.data))


def liquid_inverse(item: bpy.types.Object) -> np.ndarray:
    """Return the transform from the world to the drawing space of a splash or a model, ``(4, 4)``.

    Raises SceneError for one that is scaled to zero.
    """
    return places.inverted(liquid_matrix(item), item.name)


def combined(matrix: Matrix, space: np.ndarray) -> Matrix:
    """Return ``matrix @ space``; exactly ``matrix`` where the mesh is its own drawing space."""
    if np.array_equal(space, np.eye(4)):
        return matrix
    return Matrix((np.array(matrix, dtype=np.float64) @ space).tolist())
