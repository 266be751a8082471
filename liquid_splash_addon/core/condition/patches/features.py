# SPDX-License-Identifier: GPL-3.0-or-later
"""The spans of a sketch as a graph: what a network may know of each, wherever it is and turned.

Knots are joined along their strokes, triangles to their corners and to the triangles with which
they share an edge. All that is said of them is lengths, speeds and angles.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from .gabriel import Knots, Patches

FAR = 0.2
"""Metres along a stroke from which on its ends do not matter."""

SLOW = 0.05
"""m/s that is added to speeds before their logarithm is taken."""

ALONE = 0.1
"""Radius that stands for that of no triangle, metres."""

MOST_AT_AN_EDGE = 7
"""Triangles of one edge of which each sees all the others."""


class SpanGraph(NamedTuple):
    """Knots ``n``, triangles ``m`` and pairs ``p`` of them with a common edge.

    knots : float32 ``(n, 14)``; triangles : float32 ``(m, 32)``; corners : int64 ``(m, 3)``;
    before, after : int64 ``(n,)``, the next knots of the stroke (the same at its ends); source,
    target : int64 ``(p,)``; pairs : float32 ``(p, 4)``.
    """

    knots: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray
    before: np.ndarray
    after: np.ndarray
    source: np.ndarray
    target: np.ndarray
    pairs: np.ndarray


class _Sketch(NamedTuple):
    """The whole of a sketch: its centre, its size (m), its mean speed (m/s)."""

    centre: np.ndarray
    size: float
    speed: float


def graph_of(knots: Knots, patches: Patches) -> SpanGraph:
    """Return the graph of a sketch's spans."""
    points = knots.points
    speed = np.linalg.norm(knots.velocities, axis=1)
    size = float(np.sqrt(points.var(axis=0).sum()))
    sketch = _Sketch(points.mean(axis=0), size, float(speed.mean()))
    before, after = _along(knots.stroke)
    tangents = points[after] - points[before]
    tangents /= _length(tangents)[:, None] + 1e-9
    crossing = _strokes_met(knots, patches)
    return SpanGraph(
        _knots(knots, patches, sketch, tangents, tangents[after] - tangents[before], crossing),
        _triangles(knots, patches, sketch, tangents, crossing),
        patches.triangles,
        before,
        after,
        *_pairs(knots, patches),
    )


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("...c,...c->...", vectors, vectors))


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...c,...c->...", a, b)


def _signed_log(x: np.ndarray) -> np.ndarray:
    return np.sign(x) * np.log1p(np.abs(x))


def _along(stroke: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the knots before and after each on its stroke."""
    numbers = np.arange(len(stroke))
    change = stroke[1:] != stroke[:-1]
    first, last = np.r_[True, change], np.r_[change, True]
    return np.where(first, numbers, numbers - 1), np.where(last, numbers, numbers + 1)


def _strokes_met(knots: Knots, patches: Patches) -> np.ndarray:
    """Return how many strokes the corners of each triangle are of, less one: 0, 1 or 2."""
    of = np.sort(knots.stroke[patches.triangles], axis=1)
    met: np.ndarray = (of[:, 1:] != of[:, :-1]).sum(axis=1)
    return met


def _knots(
    knots: Knots,
    patches: Patches,
    sketch: _Sketch,
    tangents: np.ndarray,
    bend: np.ndarray,
    crossing: np.ndarray,
) -> np.ndarray:
    """Return what is said of the knots ``(n, 14)``."""
    speed = np.linalg.norm(knots.velocities, axis=1) + SLOW
    start, end = _to_the_ends(knots)
    offset = (knots.points - sketch.centre) / sketch.size
    near, near_other, count = _closest(patches.triangles, patches.radii, crossing, len(speed))
    columns = [
        np.log(speed),
        np.log(speed / (sketch.speed + SLOW)),
        np.minimum(start, FAR),
        np.minimum(end, FAR),
        np.log(start + end + 0.01),
        _length(bend),
        patches.sure,
        np.log(near),
        np.log(near_other),
        np.log(count + 1),
        _length(offset),
        np.abs(_dot(offset, patches.normals)),
        _dot(offset, tangents),
        np.full(len(speed), np.log(sketch.size)),
    ]
    return np.stack(columns, axis=1).astype(np.float32)


def _to_the_ends(knots: Knots) -> tuple[np.ndarray, np.ndarray]:
    """Return how far each knot is from the start and the end of its stroke, metres along it."""
    change = knots.stroke[1:] != knots.stroke[:-1]
    steps = np.where(change, 0.0, _length(np.diff(knots.points, axis=0)))
    along = np.concatenate([[0.0], np.cumsum(steps)])
    starts, ends = along[np.r_[True, change]], along[np.r_[change, True]]
    which = np.concatenate([[0], np.cumsum(change)])
    return along - starts[which], ends[which] - along


@njit(cache=True)
def _closest(triangles, radii, crossing, count):
    """Return the least radius at each knot, the least of those to other strokes, how many."""
    near, near_other = np.full(count, ALONE), np.full(count, ALONE)
    many = np.zeros(count)
    for n in range(len(triangles)):
        for i in range(3):
            corner = triangles[n, i]
            near[corner] = min(near[corner], radii[n])
            if crossing[n]:
                near_other[corner] = min(near_other[corner], radii[n])
            many[corner] += 1
    return near, near_other, many


def _triangles(
    knots: Knots, patches: Patches, sketch: _Sketch, tangents: np.ndarray, crossing: np.ndarray
) -> np.ndarray:
    """Return what is said of the triangles ``(m, 32)``."""
    corners, normals = patches.triangles, patches.faces
    points, flow = knots.points[corners], knots.velocities[corners]
    speed = _length(flow.mean(axis=1)) + SLOW
    divergence, curl, area = _gradient(points, flow, normals)
    offset = (points.mean(axis=1) - sketch.centre) / sketch.size
    edges = np.sort(_length(points - np.roll(points, 1, axis=1)), axis=1)
    along = tangents[corners]
    columns = [
        np.log(patches.radii),
        *patches.quality[:, 1:].T,
        np.log(area + 1e-7),
        np.abs(_dot(flow.mean(axis=1), normals)) / speed,
        _signed_log(divergence / 10),
        np.log1p(np.abs(curl) / 10),
        _signed_log(divergence * patches.radii / speed),
        np.log(speed),
        np.log(patches.radii / sketch.size),
        _length(offset),
        np.abs(_dot(offset, normals)),
        np.full(len(corners), (knots.stroke[-1] + 1) / 10),
        np.full(len(corners), np.log(sketch.size)),
        np.full(len(corners), np.log(sketch.speed + SLOW)),
        *np.log(edges + 1e-4).T,
        *np.eye(3)[crossing].T,
        *np.sort(np.abs(_dot(along, normals[:, None])), axis=1).T,
        *np.sort(np.abs(_dot(along, np.roll(along, 1, axis=1))), axis=1).T,
        *np.sort(np.abs(_dot(patches.normals[corners], normals[:, None])), axis=1).T,
        *np.sort(patches.sure[corners], axis=1)[:, [0, 2]].T,
    ]
    return np.stack(columns, axis=1).astype(np.float32)


def _gradient(
    points: np.ndarray, flow: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return divergence and curl (1/s) of the flow in each triangle's plane, and its area (m^2).

    points, flow : ``(m, 3, 3)``, of the corners. By the edges against the gradients of the
    barycentric coordinates.
    """
    opposite = np.roll(points, -1, axis=1) - np.roll(points, 1, axis=1)
    turned = np.cross(normals[:, None], opposite)  # twice the area times such a gradient
    twice = _dot(turned[:, 0], points[:, 0] - points[:, 1])  # negative where normals are turned
    area = np.maximum(np.abs(twice) / 2, 1e-9)
    gradients = turned * (np.sign(twice) / (2 * area))[:, None, None]
    divergence = _dot(gradients, flow).sum(axis=1)
    curl = _dot(np.cross(gradients, flow), normals[:, None]).sum(axis=1)
    return divergence, curl, area


def _pairs(knots: Knots, patches: Patches) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return source, target and what is said ``(p, 4)`` of the triangles with a common edge."""
    points, corners = knots.points, patches.triangles
    start = corners.T.ravel()
    end = np.roll(corners, -1, axis=1).T.ravel()
    opposite = np.roll(corners, -2, axis=1).T.ravel()
    triangle = np.tile(np.arange(len(corners)), 3)
    key = np.minimum(start, end) * len(points) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    key, triangle, opposite = key[order], triangle[order], opposite[order]
    one, other = [], []
    for apart in range(1, MOST_AT_AN_EDGE):
        same = np.flatnonzero(key[apart:] == key[:-apart])
        one += [same, same + apart]
        other += [same + apart, same]
    source, target = np.concatenate(one), np.concatenate(other)
    low, high = np.divmod(key[source], len(points))
    edge = points[high] - points[low]
    length = _length(edge) + 1e-30
    edge = edge / length[:, None]
    arms = []
    for side in (source, target):
        arm = points[opposite[side]] - points[low]
        arm = arm - _dot(arm, edge)[:, None] * edge
        arms.append(arm / (_length(arm) + 1e-30)[:, None])
    said = [
        _dot(*arms),
        np.log(length + 1e-4),
        knots.stroke[low] == knots.stroke[high],
        np.log(patches.radii[triangle[source]] / patches.radii[triangle[target]]),
    ]
    return triangle[source], triangle[target], np.stack(said, axis=1).astype(np.float32)
