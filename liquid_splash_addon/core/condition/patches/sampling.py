# SPDX-License-Identifier: GPL-3.0-or-later
"""Curved patches between strokes (PN triangles, Vlachos et al. 2001) and samples of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiling import njit
from ...grid import LOCAL_SPACING
from .gabriel import Patches, SamplePoints

SAMPLE_SPACING = 0.75 * LOCAL_SPACING
"""Distance of the samples on a patch, metres."""

QUALITIES = 5
"""Of a patch: closeness, fairness, coherence, and the classifier's two verdicts."""


class PatchSamples(NamedTuple):
    """Samples of patches, dense enough to reach each cell that they cross.

    points : float32 ``(n, 3)``, metres; values : float32 ``(n, 8)``: closeness, fairness,
    coherence (``gabriel.qualities``), how likely the patch lies in liquid and how likely within a
    cell of it, and the velocity, in the strokes' unit.
    """

    points: np.ndarray
    values: np.ndarray

    @classmethod
    def none(cls) -> PatchSamples:
        """Return the samples of no patches."""
        return cls(np.zeros((0, 3), np.float32), np.zeros((0, QUALITIES + 3), np.float32))


def sample_patches(samples: SamplePoints, patches: Patches, quality: np.ndarray) -> PatchSamples:
    """Return samples of all patches, at most SAMPLE_SPACING apart, each with its ``quality``.

    quality : ``(m, q)``; the samples' values are ``(n, q + 3)``. Rows run from the corner
    opposite the shortest edge to that edge.
    """
    points, velocities = samples.points, samples.velocities
    turned, rows = _turn(points, patches.triangles, SAMPLE_SPACING)
    first = _count(points, turned, rows, SAMPLE_SPACING)
    where = np.empty((first[-1], 3), dtype=np.float32)
    kinds = quality.shape[1]
    values = np.empty((first[-1], kinds + 3), dtype=np.float32)
    _sample(
        points, velocities, turned, rows, patches.normals, patches.confidence, SAMPLE_SPACING,
        where, values[:, kinds:],
    )  # fmt: skip
    _label(values, quality, first)
    return PatchSamples(where, values)


@njit(cache=True)
def _label(values, quality, first):
    """Give all samples of a triangle, from ``first`` on, its qualities."""
    for n in range(len(quality)):
        for at in range(first[n], first[n + 1]):
            for k in range(quality.shape[1]):
                values[at, k] = quality[n, k]


@njit(cache=True)
def _edge(points, a, b):
    square = 0.0
    for i in range(3):  # an array of the difference would take most of the time
        square += (points[a, i] - points[b, i]) ** 2
    return np.sqrt(square)


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
    """Return where each triangle's samples begin, and the end ``(m + 1,)``."""
    first = np.zeros(len(turned) + 1, dtype=np.int64)
    for n in range(len(turned)):
        first[n + 1] = first[n]
        for row in range(rows[n] + 1):
            first[n + 1] += _columns(points, turned[n], rows[n], row, step) + 1
    return first


@njit(cache=True)
def _sample(points, velocities, turned, rows, normals, confidence, step, where, flow):
    control, place = np.empty((7, 3)), np.empty((4, 3))
    at = 0
    for n in range(len(turned)):
        _controls(points, turned[n], normals, confidence, control)
        p, q, r = points[turned[n, 0]], points[turned[n, 1]], points[turned[n, 2]]
        f = velocities[turned[n, 0]]
        g, h = velocities[turned[n, 1]], velocities[turned[n, 2]]
        for row in range(rows[n] + 1):
            w = 1 - row / rows[n]
            _row(p, q, r, control, w, place)
            columns = _columns(points, turned[n], rows[n], row, step)
            for column in range(columns + 1):
                v = (1 - w) * (column / max(columns, 1))
                for a in range(3):
                    where[at, a] = place[0, a] + v * (
                        place[1, a] + v * (place[2, a] + v * place[3, a])
                    )
                    flow[at, a] = w * f[a] + (1 - w) * g[a] + v * (h[a] - g[a])
                at += 1


@njit(cache=True)
def _row(p, q, r, c, w, place):
    """Set the cubic in v that a PN triangle (their eq. 2) is where its first coordinate is w.

    p, q, r : its corners; c : its other control points. The coordinates are w, 1 - w - v, v.
    """
    s = 1 - w
    for a in range(3):
        place[0, a] = w**3 * p[a] + 3 * w * s * (w * c[0, a] + s * c[1, a]) + s**3 * q[a]
        place[1, a] = 3 * (
            w * w * (c[2, a] - c[0, a]) + 2 * w * s * (c[6, a] - c[1, a]) + s * s * (c[4, a] - q[a])
        )
        place[2, a] = 3 * (
            w * (c[1, a] - 2 * c[6, a] + c[3, a]) + s * (q[a] - 2 * c[4, a] + c[5, a])
        )
        place[3, a] = r[a] - q[a] + 3 * (c[4, a] - c[5, a])


@njit(cache=True)
def _controls(points, corners, normals, confidence, control):
    """Set the control points of a PN triangle (their eq. 3): six on the edges, one inside."""
    control[6] = 0
    k = 0
    for i in range(3):
        for j in range(i + 1, 3):
            for first, second in ((corners[i], corners[j]), (corners[j], corners[i])):
                normal = normals[first]
                edge = points[second] - points[first]
                off = confidence[first] * np.dot(edge, normal)
                control[k] = points[first] + (edge - off * normal) / 3
                control[6] += control[k] / 4
                k += 1
    for i in range(3):
        control[6] -= points[corners[i]] / 6
