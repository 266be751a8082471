# SPDX-License-Identifier: GPL-3.0-or-later
"""What films, rims and beads of a finished mesh measure, found from its triangles alone."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from liquid_splash_addon.core.mesh.closest_point import nearest_on_mesh
from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.numeric.triangles import face_areas, vertex_normals
from liquid_splash_addon.core.refinement.sheet_mesh import SheetMesh
from liquid_splash_addon.core.refinement.sheets import Sheeted

SAMPLES = 1500
"""Places that are measured."""

FILM, FREE = 0.98, 0.9
"""Share from which liquid is film, and from which an edge is free: not that of bulk or a jet."""

FROM_RIM = 3.5
"""Cells from a rim's line to where there is film alone."""


def chosen(where: np.ndarray, most: int = SAMPLES) -> np.ndarray:
    """Return numbers of vertices where ``where`` is true, evenly picked from all of them."""
    found = np.flatnonzero(where)
    return found[np.linspace(0, len(found) - 1, min(len(found), most)).astype(int)]


def across(mesh: Mesh, vertices: np.ndarray, reach: float) -> np.ndarray:
    """Return how far it is from vertices to the opposite side along their normals; or NaN.

    vertices : numbers ``(n,)``; reach : beyond which nothing is looked for, m.
    """
    normals = vertex_normals(mesh.vertices, mesh.faces).astype(np.float64)
    corners = mesh.vertices.astype(np.float64)[mesh.faces]
    tree = cKDTree(corners.mean(axis=1))
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    found = np.full(len(vertices), np.nan)
    for n, vertex in enumerate(vertices.tolist()):
        begin, way = mesh.vertices[vertex].astype(np.float64), -normals[vertex]
        near = tree.query_ball_point(begin + 0.5 * reach * way, 0.5 * reach + edges)
        near = np.array([f for f in near if vertex not in mesh.faces[f]], dtype=int)
        hits = pierced(begin, way, corners[near])
        hits = hits[(hits > 0) & (hits < reach)]
        if len(hits):
            found[n] = hits.min()
    return found


def pierced(begin: np.ndarray, way: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return how far along a ray it meets those of the triangles that it meets, ``(k,)``.

    (Moeller and Trumbore 1997.)
    """
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(way, second)
    scale = (first * p).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = begin - triangles[:, 0]
        u = (off * p).sum(axis=1) / scale
        q = np.cross(off, first)
        v, far = q @ way / scale, (second * q).sum(axis=1) / scale
    inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & np.isfinite(far)
    return far[inside]


def film_ratios(prepared: SheetMesh, made: Sheeted) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return thickness over what was asked for where there is film alone, each place's area, and
    what was asked for there, m.

    Where the liquid was thinner than the film is to be, it is to keep its thickness.
    """
    cell, count = prepared.spacing, len(prepared.share)
    inside = (prepared.share > FILM) & (prepared.rim_distance > FROM_RIM * cell)
    places = chosen(inside)
    wanted = np.minimum(made.film, 2 * prepared.room)[places]
    found = across(made.mesh, places, 6 * cell)
    areas = np.bincount(
        made.mesh.faces.ravel(), np.repeat(face_areas(made.mesh.vertices, made.mesh.faces) / 3, 3)
    )[:count][places]
    known = np.isfinite(found)
    return found[known] / wanted[known], areas[known], wanted[known]


def rim_ratios(prepared: SheetMesh, made: Sheeted) -> np.ndarray:
    """Return the radius of the largest ball in each part of the free rims over what was asked for.

    Balls begin in the middles of rims and grow away from what is nearest.
    """
    on_rim = (prepared.rim == np.arange(len(prepared.rim))) & (prepared.share > FREE)
    places = chosen(on_rim)
    wanted = made.rim[places].astype(np.float64)
    triangles = made.mesh.vertices.astype(np.float64)[made.mesh.faces]
    middle = prepared.faired[places].astype(np.float64)
    there, best = middle.copy(), np.zeros(len(places))
    reach = 4 * float(wanted.max(initial=prepared.spacing))
    step = np.full(len(places), 0.4)
    trial = middle.copy()
    for _ in range(16):
        radius, nearest, winding = nearest_on_mesh(triangles, trial, reach)
        radius = np.where(winding > 0, radius, -radius)
        near = np.linalg.norm(trial - middle, axis=1) < 1.2 * wanted
        better = (radius > best) & near
        there[better], best[better] = trial[better], radius[better]
        step[~better] *= 0.6
        out = trial - nearest
        if not better.all():
            _, nearest, _ = nearest_on_mesh(triangles, there, reach)
            out = there - nearest
        out *= np.sign(best)[:, None] / np.maximum(
            np.linalg.norm(out, axis=1, keepdims=True), 1e-12
        )
        trial = there + (step * wanted)[:, None] * out
    return best / wanted


def bead_gaps(prepared: SheetMesh, made: Sheeted) -> np.ndarray:
    """Return the ways along rims between neighbouring beads, over their rim's radius."""
    on_rim = prepared.rim == np.arange(len(prepared.rim))
    begin = np.repeat(np.arange(len(on_rim)), np.diff(prepared.first))
    kept = on_rim[begin] & on_rim[prepared.near]
    a, b = begin[kept], prepared.near[kept]
    ways = np.linalg.norm(prepared.faired[a] - prepared.faired[b], axis=1).astype(np.float64)
    graph = coo_matrix((np.maximum(ways, 1e-12), (a, b)), shape=(len(on_rim),) * 2).tocsr()
    if not len(made.beads):
        return np.zeros(0)
    away, _, owner = dijkstra(graph, indices=made.beads, min_only=True, return_predecessors=True)
    meet = (owner[a] != owner[b]) & (owner[a] >= 0) & (owner[b] >= 0)
    gaps: dict[tuple[int, int], float] = {}
    for u, v, way in zip(a[meet], b[meet], ways[meet], strict=True):
        pair = min(owner[u], owner[v]), max(owner[u], owner[v])
        gaps[pair] = min(gaps.get(pair, np.inf), away[u] + way + away[v])
    return np.array([gap / made.rim[list(pair)].mean() for pair, gap in gaps.items()])
