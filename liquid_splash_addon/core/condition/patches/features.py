# SPDX-License-Identifier: GPL-3.0-or-later
"""The patches of a sketch as a graph: what a network may know of each, wherever it is and turned.

Sample points are joined along their strokes, triangles to their corners and to the triangles with
which they share an edge. All that is told of them is lengths, speeds and angles.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...compiling import njit
from .gabriel import Patches, SamplePoints

FAR = 0.2
"""Metres along a stroke from which on its ends do not matter."""

SLOW = 0.05
"""m/s that is added to speeds before their logarithm is taken."""

ALONE = 0.1
"""Radius that stands for that of no triangle, metres."""

MOST_AT_AN_EDGE = 7
"""Triangles of one edge of which each sees all the others."""

POINT_FEATURES = (
    "log_speed", "log_relative_speed", "to_start", "to_end", "log_stroke_length", "bend",
    "normal_confidence", "log_least_radius", "log_least_radius_between_strokes",
    "log_triangle_count", "offset", "offset_along_normal", "offset_along_stroke", "log_size",
)  # fmt: skip
TRIANGLE_FEATURES = (
    "log_radius", "fairness", "coherence", "log_area", "flow_across", "divergence", "curl",
    "relative_divergence", "log_speed", "log_relative_radius", "offset", "offset_along_normal",
    "strokes", "log_size", "log_mean_speed",
    "log_edge_0", "log_edge_1", "log_edge_2",
    "within_one_stroke", "between_two_strokes", "between_three_strokes",
    "stroke_across_0", "stroke_across_1", "stroke_across_2",
    "strokes_parallel_0", "strokes_parallel_1", "strokes_parallel_2",
    "normal_agreement_0", "normal_agreement_1", "normal_agreement_2",
    "least_normal_confidence", "greatest_normal_confidence",
)  # fmt: skip
EDGE_FEATURES = ("fold_cosine", "log_edge", "along_stroke", "log_radius_ratio")
"""What the columns tell; the names stand in the weights' header. Numbered ones are in order of
size: which corner is first means nothing."""


class PatchGraph(NamedTuple):
    """Sample points ``n``, triangles ``m`` and pairs ``p`` of triangles with a common edge.

    points : float32 ``(n, 14)`` of POINT_FEATURES; triangles : float32 ``(m, 32)`` of
    TRIANGLE_FEATURES; corners : int64 ``(m, 3)``; before, after : int64 ``(n,)``, the next points
    of the stroke (the same at its ends); source, target : int64 ``(p,)``; pairs : float32
    ``(p, 4)`` of EDGE_FEATURES.
    """

    points: np.ndarray
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


def patch_graph(samples: SamplePoints, patches: Patches) -> PatchGraph:
    """Return the graph of a sketch's patches."""
    points = samples.points
    speed = np.linalg.norm(samples.velocities, axis=1)
    size = float(np.sqrt(points.var(axis=0).sum()))
    sketch = _Sketch(points.mean(axis=0), size, float(speed.mean()))
    before, after = _along(samples.stroke)
    tangents = points[after] - points[before]
    tangents /= _length(tangents)[:, None] + 1e-9
    crossing = _strokes_met(samples, patches)
    return PatchGraph(
        _point_features(
            samples, patches, sketch, tangents, tangents[after] - tangents[before], crossing
        ),
        _triangle_features(samples, patches, sketch, tangents, crossing),
        patches.triangles,
        before,
        after,
        *_edge_features(samples, patches),
    )


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("...c,...c->...", vectors, vectors))


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...c,...c->...", a, b)


def _signed_log(x: np.ndarray) -> np.ndarray:
    return np.sign(x) * np.log1p(np.abs(x))


def _along(stroke: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the sample points before and after each on its stroke."""
    numbers = np.arange(len(stroke))
    change = stroke[1:] != stroke[:-1]
    first, last = np.r_[True, change], np.r_[change, True]
    return np.where(first, numbers, numbers - 1), np.where(last, numbers, numbers + 1)


def _strokes_met(samples: SamplePoints, patches: Patches) -> np.ndarray:
    """Return how many strokes the corners of each triangle are of, less one: 0, 1 or 2."""
    of = np.sort(samples.stroke[patches.triangles], axis=1)
    met: np.ndarray = (of[:, 1:] != of[:, :-1]).sum(axis=1)
    return met


def _point_features(
    samples: SamplePoints,
    patches: Patches,
    sketch: _Sketch,
    tangents: np.ndarray,
    bend: np.ndarray,
    crossing: np.ndarray,
) -> np.ndarray:
    """Return the POINT_FEATURES ``(n, 14)``."""
    speed = np.linalg.norm(samples.velocities, axis=1) + SLOW
    start, end = _to_the_ends(samples)
    offset = (samples.points - sketch.centre) / sketch.size
    near, near_other, count = _closest(patches.triangles, patches.radii, crossing, len(speed))
    features = {
        "log_speed": np.log(speed),
        "log_relative_speed": np.log(speed / (sketch.speed + SLOW)),
        "to_start": np.minimum(start, FAR),
        "to_end": np.minimum(end, FAR),
        "log_stroke_length": np.log(start + end + 0.01),
        "bend": _length(bend),
        "normal_confidence": patches.confidence,
        "log_least_radius": np.log(near),
        "log_least_radius_between_strokes": np.log(near_other),
        "log_triangle_count": np.log(count + 1),
        "offset": _length(offset),
        "offset_along_normal": np.abs(_dot(offset, patches.normals)),
        "offset_along_stroke": _dot(offset, tangents),
        "log_size": np.full(len(speed), np.log(sketch.size)),
    }
    return _columns(features, POINT_FEATURES)


def _to_the_ends(samples: SamplePoints) -> tuple[np.ndarray, np.ndarray]:
    """Return how far each point is from the start and the end of its stroke, metres along it."""
    change = samples.stroke[1:] != samples.stroke[:-1]
    steps = np.where(change, 0.0, _length(np.diff(samples.points, axis=0)))
    along = np.concatenate([[0.0], np.cumsum(steps)])
    starts, ends = along[np.r_[True, change]], along[np.r_[change, True]]
    which = np.concatenate([[0], np.cumsum(change)])
    return along - starts[which], ends[which] - along


@njit(cache=True)
def _closest(triangles, radii, crossing, count):
    """Return the least radius at each point, the least of those to other strokes, how many."""
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


def _triangle_features(
    samples: SamplePoints,
    patches: Patches,
    sketch: _Sketch,
    tangents: np.ndarray,
    crossing: np.ndarray,
) -> np.ndarray:
    """Return the TRIANGLE_FEATURES ``(m, 32)``."""
    corners, normals = patches.triangles, patches.faces
    points, flow = samples.points[corners], samples.velocities[corners]
    speed = _length(flow.mean(axis=1)) + SLOW
    divergence, curl, area = _gradient(points, flow, normals)
    offset = (points.mean(axis=1) - sketch.centre) / sketch.size
    edges = np.sort(_length(points - np.roll(points, 1, axis=1)), axis=1)
    along = tangents[corners]
    confidence = np.sort(patches.confidence[corners], axis=1)
    features = {
        "log_radius": np.log(patches.radii),
        "fairness": patches.quality[:, 1],
        "coherence": patches.quality[:, 2],
        "log_area": np.log(area + 1e-7),
        "flow_across": np.abs(_dot(flow.mean(axis=1), normals)) / speed,
        "divergence": _signed_log(divergence / 10),
        "curl": np.log1p(np.abs(curl) / 10),
        "relative_divergence": _signed_log(divergence * patches.radii / speed),
        "log_speed": np.log(speed),
        "log_relative_radius": np.log(patches.radii / sketch.size),
        "offset": _length(offset),
        "offset_along_normal": np.abs(_dot(offset, normals)),
        "strokes": np.full(len(corners), (samples.stroke[-1] + 1) / 10),
        "log_size": np.full(len(corners), np.log(sketch.size)),
        "log_mean_speed": np.full(len(corners), np.log(sketch.speed + SLOW)),
        **_numbered("log_edge", np.log(edges + 1e-4)),
        "within_one_stroke": crossing == 0,
        "between_two_strokes": crossing == 1,
        "between_three_strokes": crossing == 2,
        **_numbered("stroke_across", _sorted_cosines(along, normals[:, None])),
        **_numbered("strokes_parallel", _sorted_cosines(along, np.roll(along, 1, axis=1))),
        **_numbered(
            "normal_agreement", _sorted_cosines(patches.normals[corners], normals[:, None])
        ),
        "least_normal_confidence": confidence[:, 0],
        "greatest_normal_confidence": confidence[:, 2],
    }
    return _columns(features, TRIANGLE_FEATURES)


def _columns(features: dict[str, np.ndarray], names: tuple[str, ...]) -> np.ndarray:
    """Return the features as columns, in the order of ``names``."""
    assert features.keys() == set(names)
    return np.stack([features[name] for name in names], axis=1).astype(np.float32)


def _numbered(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    """Return the columns of ``values`` ``(m, 3)`` by name."""
    return {f"{name}_{number}": column for number, column in enumerate(values.T)}


def _sorted_cosines(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cosines, without their signs, of three angles of each triangle, in order."""
    return np.sort(np.abs(_dot(a, b)), axis=1)


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


def _edge_features(
    samples: SamplePoints, patches: Patches
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return source and target ``(p,)`` of triangles with a common edge, and EDGE_FEATURES."""
    points, corners = samples.points, patches.triangles
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
    radii = patches.radii
    features = {
        "fold_cosine": _dot(*arms),
        "log_edge": np.log(length + 1e-4),
        "along_stroke": samples.stroke[low] == samples.stroke[high],
        "log_radius_ratio": np.log(radii[triangle[source]] / radii[triangle[target]]),
    }
    return triangle[source], triangle[target], _columns(features, EDGE_FEATURES)
