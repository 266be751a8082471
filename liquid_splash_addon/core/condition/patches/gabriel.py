# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches between neighbouring strokes: the triangles of their Gabriel complex.

A splash is thin sheets, and a stroke tells of a line of one. Which strokes lie side by side on a
sheet is a matter of the whole sketch, hard for convolutions to find and easy for geometry: the
triangles between sample points of the strokes whose smallest circumscribed ball holds no other
point, curved as the strokes around them say (``sampling``). A graph network classifies which of
them lie in liquid (``generator.patch_classifier``).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...compiling import njit
from ...numeric.triangles import face_normals
from ...sketch.strokes import Stroke, resample

WIDEST = 0.08
"""Radius of the ball around the widest triangle, metres: half of those of 0.05 to 0.1 that it
would allow lie in no liquid, nearly all below 0.02 do."""

STEP = 0.006
"""Metres between the points of a stroke."""

MOST_POINTS = 1500
"""Of all strokes; they are farther apart where there would be more."""

SMOOTHED = 0.008
"""Metres along a stroke over which its normals are averaged."""

BLUR = 1e-5
"""Metres by which points are moved at random: strokes in a plane or on a sphere have no unique
triangles."""


class SamplePoints(NamedTuple):
    """Sample points of all strokes.

    points, velocities : float64 ``(n, 3)``; stroke : int ``(n,)``, which one it is of; step :
    metres between those of a stroke.
    """

    points: np.ndarray
    velocities: np.ndarray
    stroke: np.ndarray
    step: float


class Patches(NamedTuple):
    """Triangles between sample points.

    triangles : int ``(m, 3)``; radii : ``(m,)`` of their balls; faces : their unit normals
    ``(m, 3)``; quality : closeness, fairness, coherence ``(m, 3)``, see :func:`qualities`;
    normals, confidence : ``(n, 3)`` and ``(n,)`` of the points, see :func:`point_normals`.
    """

    triangles: np.ndarray
    radii: np.ndarray
    faces: np.ndarray
    quality: np.ndarray
    normals: np.ndarray
    confidence: np.ndarray


def sample_points_of(strokes: Sequence[Stroke]) -> SamplePoints:
    """Resample the strokes STEP apart, each point a little out of place (BLUR)."""
    step = max(STEP, sum(stroke.length for stroke in strokes) / MOST_POINTS)
    fine = [resample(stroke, step) for stroke in strokes]
    points = np.concatenate([stroke.points for stroke in fine]).astype(np.float64)
    points += np.random.default_rng(0).normal(0, BLUR, points.shape)
    velocities = np.concatenate([stroke.velocities for stroke in fine]).astype(np.float64)
    which = np.repeat(np.arange(len(fine)), [len(stroke.points) for stroke in fine])
    return SamplePoints(points, velocities, which, step)


def find_patches(samples: SamplePoints) -> Patches:
    """Find the patches between sample points, with all that tells of them but verdicts."""
    triangles, radii = gabriel_triangles(samples.points, WIDEST)
    faces = face_normals(samples.points, triangles)
    normals, confidence = point_normals(samples, triangles, radii, faces)
    quality = qualities(samples, triangles, radii, faces, normals)
    return Patches(triangles, radii, faces, quality, normals, confidence)


def gabriel_triangles(points: np.ndarray, widest: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles ``(m, 3)`` of ``points`` whose smallest ball is empty, and its radius.

    They are faces of the Delaunay tetrahedra, and a ball is empty if it is so of the corners
    opposite. points : float64 ``(n, 3)``; widest : radius of the largest ball.
    """
    from scipy.spatial import Delaunay, QhullError

    none = np.zeros((0, 3), dtype=np.int64), np.zeros(0)
    if len(points) < 5:
        return none
    try:
        mesh = Delaunay(points)
    except QhullError:  # all points in one place
        return none
    faces, radii = _empty_balls(
        points, mesh.simplices.astype(np.int64), mesh.neighbors.astype(np.int64), widest
    )
    order = np.lexsort(faces.T[::-1])
    return faces[order], radii[order]


@njit(cache=True)
def _empty_balls(points, tetrahedra, neighbours, widest):
    """Return the faces of tetrahedra, corners in order, with empty balls, and the balls' radii."""
    faces = np.empty((4 * len(tetrahedra), 3), dtype=np.int64)
    radii = np.empty(4 * len(tetrahedra))
    centre = np.empty(3)
    count = 0
    for n in range(len(tetrahedra)):
        for k in range(4):
            other = neighbours[n, k]
            if 0 <= other < n:  # seen from there
                continue
            _others(tetrahedra[n], k, faces[count])
            square = _smallest_ball(points, faces[count], centre)
            empty = not _holds(centre, square, points, tetrahedra[n, k])
            if empty and other >= 0:
                beyond = tetrahedra[other].sum() - faces[count].sum()
                empty = not _holds(centre, square, points, beyond)
            if empty and square < widest * widest:
                radii[count] = np.sqrt(square)
                count += 1
    return faces[:count].copy(), radii[:count].copy()


@njit(cache=True)
def _others(corners, k, face):
    """Set the corners of a tetrahedron but the ``k``-th, the least first."""
    at = 0
    for i in range(4):
        if i != k:
            j = at
            while j > 0 and face[j - 1] > corners[i]:
                face[j] = face[j - 1]
                j -= 1
            face[j] = corners[i]
            at += 1


@njit(cache=True)
def _smallest_ball(points, face, centre):
    """Set the centre of the smallest ball through a face's corners; return its squared radius."""
    a, b, c = face
    uu, vv, uv = 0.0, 0.0, 0.0
    for i in range(3):
        u, v = points[b, i] - points[a, i], points[c, i] - points[a, i]
        uu, vv, uv = uu + u * u, vv + v * v, uv + u * v
    area = max(2 * (uu * vv - uv * uv), 1e-30)
    s, t = vv * (uu - uv) / area, uu * (vv - uv) / area
    square = 0.0
    for i in range(3):
        away = s * (points[b, i] - points[a, i]) + t * (points[c, i] - points[a, i])
        centre[i] = points[a, i] + away
        square += away * away
    return square


@njit(cache=True)
def _holds(centre, square, points, which):
    apart = 0.0
    for i in range(3):
        apart += (points[which, i] - centre[i]) ** 2
    return apart < square * (1 - 1e-9)


def point_normals(
    samples: SamplePoints, triangles: np.ndarray, radii: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the sheet's normal at each point ``(n, 3)``, of either sign, and its confidence, 0..1.

    The main axis of the normals of the triangles there and a little along the stroke, each by
    its angle and closeness: signs do not matter, and of sheets that cross the closest counts.
    """
    spread = _spread(samples.points, triangles, radii, faces)
    spread = _along(spread, samples.stroke, SMOOTHED / samples.step)
    values, axes = np.linalg.eigh(spread)
    confidence = (values[:, 2] - values[:, 1]) / np.maximum(values[:, 2], 1e-30)
    return np.ascontiguousarray(axes[:, :, 2]), confidence


@njit(cache=True)
def _spread(points, triangles, radii, faces):
    """Return the sum of the outer products of the normals at each point ``(n, 3, 3)``."""
    spread = np.zeros((len(points), 3, 3))
    for n in range(len(triangles)):
        for i in range(3):
            corner = triangles[n, i]
            u = points[triangles[n, (i + 1) % 3]] - points[corner]
            v = points[triangles[n, (i + 2) % 3]] - points[corner]
            lengths = np.sqrt(np.dot(u, u) * np.dot(v, v))
            angle = np.arccos(min(max(np.dot(u, v) / max(lengths, 1e-30), -1.0), 1.0))
            for a in range(3):
                for b in range(3):
                    spread[corner, a, b] += angle / radii[n] * faces[n, a] * faces[n, b]
    return spread


@njit(cache=True)
def _along(spread, stroke, width):
    """Return ``(n, 3, 3)`` averaged along each stroke, by a Gaussian of ``width`` points."""
    smooth = np.zeros_like(spread)
    reach = int(np.ceil(3 * width))
    for n in range(len(spread)):
        for m in range(max(n - reach, 0), min(n + reach + 1, len(spread))):
            if stroke[m] == stroke[n]:
                smooth[n] += np.exp(-0.5 * ((m - n) / width) ** 2) * spread[m]
    return smooth


def qualities(
    samples: SamplePoints,
    triangles: np.ndarray,
    radii: np.ndarray,
    faces: np.ndarray,
    normals: np.ndarray,
) -> np.ndarray:
    """Return closeness, fairness and coherence of each triangle ``(m, 3)``.

    Closeness: 1 where strokes touch, 0 where the ball between them has the radius WIDEST.
    Fairness: cosine of the angle between the triangle and the sheet that the others at its
    corners suggest. Coherence: 1 where its corners have one velocity.
    """
    fair = np.abs(np.einsum("nic,nc->ni", normals[triangles], faces)).min(axis=1)
    flow = samples.velocities[triangles]  # (m, corner, 3)
    apart = np.linalg.norm(flow - np.roll(flow, 1, axis=1), axis=2).max(axis=1)
    speed = np.linalg.norm(flow.mean(axis=1), axis=1)
    coherent = np.exp(-apart / np.maximum(speed, 1e-6))
    return np.stack([1 - radii / WIDEST, fair, coherent], axis=1)
