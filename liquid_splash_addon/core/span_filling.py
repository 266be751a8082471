# SPDX-License-Identifier: GPL-3.0-or-later
"""Curved patches between strokes (PN triangles, Vlachos et al. 2001), filled with samples."""

from __future__ import annotations

import numpy as np
from numba import njit

from .grid import LOCAL_SPACING
from .spans import Knots, Patches, Spans

FILLED = 0.75 * LOCAL_SPACING
"""Distance of the samples on a triangle, metres."""


def fill(knots: Knots, patches: Patches, quality: np.ndarray) -> Spans:
    """Return samples of all patches, at most FILLED apart, each with its patch's ``quality``.

    quality : ``(m, q)``; the samples' values are ``(n, q + 3)``. Rows run from the corner
    opposite the shortest edge to that edge.
    """
    points, velocities = knots.points, knots.velocities
    turned, rows = _turn(points, patches.triangles, FILLED)
    total = _count(points, turned, rows, FILLED)
    where = np.empty((total, 3), dtype=np.float32)
    values = np.empty((total, quality.shape[1] + 3), dtype=np.float32)
    _sample(
        points, velocities, turned, rows, patches.normals, patches.sure, quality, FILLED,
        where, values,
    )  # fmt: skip
    return Spans(where, values)


@njit(cache=True)
def _edge(points, a, b):
    d = points[a] - points[b]
    return np.sqrt(np.dot(d, d))


@njit(cache=True)
def _turn(points, triangles, step):
    """Return the triangles with the shortest edge last, and the rows that each needs."""
    turned = triangles.copy()
    rows = np.empty(len(triangles), dtype=np.int64)
    for n in range(len(triangles)):
        best, first = np.inf, 0
        for i in range(3):
            edge = _edge(points, triangles[n, (i + 1) % 3], triangles[n, (i + 2) % 3])
            if edge < best:
                best, first = edge, i
        for i in range(3):
            turned[n, i] = triangles[n, (first + i) % 3]
        longest = max(
            _edge(points, turned[n, 0], turned[n, 1]), _edge(points, turned[n, 0], turned[n, 2])
        )
        rows[n] = int(np.ceil(longest / step))
    return turned, rows


@njit(cache=True)
def _columns(points, turned, rows, row, step):
    """Return the steps that a row of a triangle needs."""
    width = _edge(points, turned[1], turned[2]) * row / rows
    return int(np.ceil(width / step))


@njit(cache=True)
def _count(points, turned, rows, step):
    total = 0
    for n in range(len(turned)):
        for row in range(rows[n] + 1):
            total += _columns(points, turned[n], rows[n], row, step) + 1
    return total


@njit(cache=True)
def _sample(points, velocities, turned, rows, normals, sure, quality, step, where, values):
    control = np.empty((7, 3))
    kinds = quality.shape[1]
    at = 0
    for n in range(len(turned)):
        _controls(points, turned[n], normals, sure, control)
        p, q, r = points[turned[n, 0]], points[turned[n, 1]], points[turned[n, 2]]
        f = velocities[turned[n, 0]]
        g, h = velocities[turned[n, 1]], velocities[turned[n, 2]]
        for row in range(rows[n] + 1):
            columns = _columns(points, turned[n], rows[n], row, step)
            for column in range(columns + 1):
                w = 1 - row / rows[n]
                v = (1 - w) * (column / max(columns, 1))
                u = 1 - w - v
                for a in range(3):
                    where[at, a] = (
                        p[a] * w**3 + q[a] * u**3 + r[a] * v**3
                        + 3 * w * u * (control[0, a] * w + control[1, a] * u)
                        + 3 * w * v * (control[2, a] * w + control[3, a] * v)
                        + 3 * u * v * (control[4, a] * u + control[5, a] * v)
                        + 6 * control[6, a] * w * u * v
                    )  # fmt: skip
                    values[at, kinds + a] = w * f[a] + u * g[a] + v * h[a]
                for k in range(kinds):
                    values[at, k] = quality[n, k]
                at += 1


@njit(cache=True)
def _controls(points, corners, normals, sure, control):
    """Set the control points of a PN triangle (their eq. 3): six on the edges, one inside."""
    control[6] = 0
    k = 0
    for i in range(3):
        for j in range(i + 1, 3):
            for first, second in ((corners[i], corners[j]), (corners[j], corners[i])):
                normal = normals[first]
                edge = points[second] - points[first]
                off = sure[first] * np.dot(edge, normal)
                control[k] = points[first] + (edge - off * normal) / 3
                control[6] += control[k] / 4
                k += 1
    for i in range(3):
        control[6] -= points[corners[i]] / 6
