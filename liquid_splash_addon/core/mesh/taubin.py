# SPDX-License-Identifier: GPL-3.0-or-later
"""Smoothing that removes the staircase of the voxels (Taubin 1995)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .mesh import edge_counts
from .self_intersection import take_back

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

TAUBIN = (0.5, -0.53)
"""Taubin's lambda and mu: the pass band ends at 1 / 0.5 - 1 / 0.53, about 0.11."""

SMOOTHING_STEPS = 12


def taubin_smoothed(
    vertices: np.ndarray, faces: np.ndarray, iterations: int = SMOOTHING_STEPS
) -> np.ndarray:
    """Return vertices ``(n, 3)``, float64, without the staircase of the voxels (Taubin 1995).

    Each iteration moves vertices towards their neighbours' mean and then a little further back:
    steps of a cell vanish while volume stays, and with it thin sheets and small drops. Where faces
    would cross, vertices move less.

    faces : int ``(m, 3)``, none crossing another.
    """
    mean = neighbour_mean(faces, len(vertices))
    moved = vertices.astype(np.float64)
    for _ in range(iterations):
        for factor in TAUBIN:
            moved = moved + factor * (mean @ moved - moved)
    return take_back(vertices.astype(np.float64), moved, faces)


def neighbour_mean(faces: np.ndarray, count: int) -> csr_matrix:
    """Return the sparse matrix ``(count, count)`` that averages each vertex's neighbours."""
    from scipy.sparse import diags

    links = edge_counts(faces, count)
    return diags(1 / np.maximum(np.asarray(links.sum(axis=1)).ravel(), 1)) @ links
