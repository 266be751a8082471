# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether an open mesh is meant as a solid: how far its inside is enclosed by what is there.

Winding numbers hold for open meshes too (Jacobson et al., SIGGRAPH 2013): at a point inside they
are the share of the view that the mesh closes off. Of a mesh whose holes are covered by films it is
one less the films' own, of which there are few.
"""

from __future__ import annotations

import numpy as np

from ..mesh.signed_distance import winding_on_grid

CELLS = 24
"""Cells along the longest side in which the inside is looked for."""

MOST_POINTS = 192
"""Most points inside at which is looked around."""

SLAB = 4096
"""Most films at a time."""

MEANT_SOLID = 0.9
"""Share of the view from inside that a solid closes off at least. A closed mesh has 1, a pot with a
loose lid 0.99, an open tube twice, four and eight times as long as wide 0.82, 0.88 and 0.93, half a
sphere 0.71."""


def enclosed_share(triangles: np.ndarray, caps: np.ndarray) -> float:
    """Return what share of the view a mesh closes off, seen from inside it: the mean.

    triangles, caps : of the mesh and of the films over its holes, ``(m, 3, 3)`` each
    0 where it has no inside.
    """
    inside = points_inside(np.concatenate([triangles, caps]))
    if not len(inside):
        return 0.0
    seen = np.zeros(len(inside))
    for first in range(0, len(caps), SLAB):
        seen += solid_angles(inside, caps[first : first + SLAB])
    return float(1 - np.abs(seen / (4 * np.pi)).clip(max=1).mean())


def points_inside(triangles: np.ndarray) -> np.ndarray:
    """Return some points ``(n, 3)`` inside a closed mesh, evenly spread."""
    corners = triangles.reshape(-1, 3)
    low, size = corners.min(axis=0), np.ptp(corners, axis=0)
    if not size.min() > 1e-6 * size.max():
        return np.zeros((0, 3))
    cells = np.maximum(np.ceil(CELLS * size / size.max()).astype(int), 8)
    edge = size / cells
    # Off the middle of cells, where modelled meshes have their edges.
    shift = np.array([0.47, 0.41, 0.53])
    within = (triangles - low) / edge - shift
    winding = winding_on_grid(within, (int(cells[0]), int(cells[1]), int(cells[2])))
    found = np.argwhere(winding != 0)
    step = max(1, len(found) // MOST_POINTS)
    return np.asarray(low + (found[::step] + shift) * edge)


def solid_angles(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the signed solid angle of triangles ``(m, 3, 3)`` from points ``(n, 3)``, summed.

    By the formula of van Oosterom and Strackee (IEEE TBME 30, 1983).
    """
    corners = triangles[None] - points[:, None, None]
    lengths = np.linalg.norm(corners, axis=-1)
    a, b, c = (corners[:, :, k] for k in range(3))
    la, lb, lc = (lengths[:, :, k] for k in range(3))
    over = np.einsum("nmk,nmk->nm", a, np.cross(b, c))
    under = (
        la * lb * lc
        + np.einsum("nmk,nmk->nm", a, b) * lc
        + np.einsum("nmk,nmk->nm", b, c) * la
        + np.einsum("nmk,nmk->nm", c, a) * lb
    )
    return np.asarray(2 * np.arctan2(over, under).sum(axis=1))
