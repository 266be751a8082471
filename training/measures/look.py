# SPDX-License-Identifier: GPL-3.0-or-later
"""What an eye sees of a surface: how bumpy it is, how thick its sheets are."""

from __future__ import annotations

import numpy as np

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.mesh.local_thickness import thickness_and_clearance
from liquid_splash_addon.core.mesh.marching_cubes import level_surface
from liquid_splash_addon.core.mesh.mesh import directed_edges

RINGS = 6
"""Over which normals are averaged: bumps of two to five cells count, bends of sheets do not."""

REACH = 12.0
"""Cells: liquid thicker than that counts as so thick."""


def look_of(level: np.ndarray, grid: Grid) -> dict[str, float]:
    """Return how the surface where ``level`` ``(X, Y, Z)`` is zero looks; nothing without any.

    roughness_deg : median angle between a vertex's normal and the mean of the normals around it;
    thickness_cells : median diameter of the ball that touches the surface from inside at a vertex
    level : cells, negative in the liquid. It is meshed as the add-on does.
    """
    if not (level < 0).any():
        return {}
    mesh = level_surface(level, np.zeros((3, *level.shape), dtype=np.float32), grid)
    points = mesh.vertices.astype(np.float64) / grid.spacing
    normals = vertex_normals(points, mesh.faces)
    mean = averaged(normals, mesh.faces, RINGS)
    cosine = (normals * mean).sum(axis=1) / np.maximum(np.linalg.norm(mean, axis=1), 1e-12)
    inward, _ = thickness_and_clearance(points.astype(np.float32), normals.astype(np.float32),
                                        REACH)  # fmt: skip
    return {
        "roughness_deg": float(np.degrees(np.median(np.arccos(np.clip(cosine, -1, 1))))),
        "thickness_cells": float(2 * np.median(inward)),
    }


def look_beside(mine: dict[str, float], truth: dict[str, float]) -> dict[str, float]:
    """Return the looks of an answer with their ratios to the truth's, as far as both have any."""
    pairs = (("roughness_deg", "roughness_over_truth"), ("thickness_cells", "thickness_over_truth"))
    ratios = {
        ratio: mine[name] / truth[name] for name, ratio in pairs if name in mine and name in truth
    }
    return {**mine, **ratios}


def vertex_normals(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the unit normals of vertices ``(n, 3)``: of the faces around, weighted by area."""
    first, second, third = (points[faces[:, n]] for n in range(3))
    across = np.cross(second - first, third - first)
    total = np.zeros_like(points)
    for corner in range(3):
        np.add.at(total, faces[:, corner], across)
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1), 1e-12)[:, None])


def averaged(values: np.ndarray, faces: np.ndarray, rings: int) -> np.ndarray:
    """Return values ``(n, d)``, each the mean of itself and its neighbours, ``rings`` times."""
    from scipy.sparse import coo_matrix, identity

    ends, count = directed_edges(faces).T, len(values)
    edges = coo_matrix((np.ones(ends.shape[1]), ends), shape=(count, count)).tocsr()
    around = identity(count, format="csr") + (edges + edges.T).sign()
    weights = 1 / np.asarray(around.sum(axis=1))
    for _ in range(rings):
        values = weights * (around @ values)
    return values
