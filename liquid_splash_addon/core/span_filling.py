# SPDX-License-Identifier: GPL-3.0-or-later
"""Curved patches between strokes (PN triangles, Vlachos et al. 2001), filled with samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from .grid import LOCAL_SPACING
from .spans import Knots, Patches, Spans

FILLED = 0.75 * LOCAL_SPACING
"""Distance of the samples on a triangle, metres."""


class Filling(NamedTuple):
    """Samples of patches, before it is known how good each patch is.

    points, velocities : float32 ``(n, 3)``; first : int64 ``(m + 1,)``, where the samples of each
    patch begin, and the end.
    """

    points: np.ndarray
    velocities: np.ndarray
    first: np.ndarray

    def spans(self, quality: np.ndarray) -> Spans:
        """Return them, each with the ``quality`` ``(m, q)`` of its patch, then its velocity."""
        values = np.empty((len(self.points), quality.shape[1] + 3), dtype=np.float32)
        _label(values, quality, self.velocities, self.first)
        return Spans(self.points, values)


def fill(knots: Knots, patches: Patches) -> Filling:
    """Return samples of all patches, at most FILLED apart.

    Rows run from the corner opposite the shortest edge to that edge.
    """
    points, velocities = knots.points, knots.velocities
    turned, rows = _turn(points, patches.triangles, FILLED)
    first = _count(points, turned, rows, FILLED)
    where, flow = (np.empty((first[-1], 3), dtype=np.float32) for _ in range(2))
    _sample(
        points, velocities, turned, rows, patches.normals, patches.sure, FILLED,
        where, flow,
    )  # fmt: skip
    return Filling(where, flow, first)


@njit(cache=True, nogil=True)
def _label(values, quality, velocities, first):
    """Set the values of all samples."""
    kinds = quality.shape[1]
    for n in range(len(quality)):
        for at in range(first[n], first[n + 1]):
            for k in range(kinds):
                values[at, k] = quality[n, k]
            for a in range(3):
                values[at, kinds + a] = velocities[at, a]


@njit(cache=True, nogil=True)
def _edge(points, a, b):
    d = points[a] - points[b]
    return np.sqrt(np.dot(d, d))


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def _columns(points, turned, rows, row, step):
    """Return the steps that a row of a triangle needs."""
    width = _edge(points, turned[1], turned[2]) * row / rows
    return int(np.ceil(width / step))


@njit(cache=True, nogil=True)
def _count(points, turned, rows, step):
    """Return where each triangle's samples begin, and the end ``(m + 1,)``."""
    first = np.zeros(len(turned) + 1, dtype=np.int64)
    for n in range(len(turned)):
        first[n + 1] = first[n]
        for row in range(rows[n] + 1):
            first[n + 1] += _columns(points, turned[n], rows[n], row, step) + 1
    return first


@njit(cache=True, nogil=True)
def _sample(points, velocities, turned, rows, normals, sure, step, where, flow):
    control = np.empty((7, 3))
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
                    flow[at, a] = w * f[a] + u * g[a] + v * h[a]
                at += 1


@njit(cache=True, nogil=True)
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
