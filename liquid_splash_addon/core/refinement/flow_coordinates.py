# SPDX-License-Identifier: GPL-3.0-or-later
"""Coordinates that stick to the flow: of any point, from the strokes around it.

Strokes are put in a row, each beside its neighbour. A point of a stroke knows its time of flight,
its way from the stroke's beginning, and by how much *across* grows towards the strokes beside it.
Elsewhere the nearest points of strokes are blended, each with its own straight continuation, so
that nothing jumps where another stroke becomes the nearest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..compiling import njit
from ..grid import LOCAL_SPACING
from ..numeric.threads import in_parts
from ..sketch.strokes import Stroke, resample
from .sheet_mesh import USUAL_AGE, flight_times

STEP = 2 * LOCAL_SPACING
"""Distance of the points of strokes that count, metres."""

NEAREST = 10
"""Points of strokes that are blended."""

SAMPLES = 16
"""Points by which distances of strokes are measured."""

MOST_ROWED = 300
"""Strokes up to which a row is sought; more are taken in the order in which they were drawn."""

STEEPEST = 3.0
"""Most by which *across* may grow in a metre: where strokes meet, it would without bound."""


@dataclass(frozen=True)
class Guides:
    """Points of strokes, and what they know, metres and seconds.

    Attributes
    ----------
    points, tangents : float32 ``(m, 3)``, the latter unit
    slopes : float32 ``(m, 3)``, gradient of *across*, at right angles to the tangent
    stroke : int32 ``(m,)``
    age, along, across, pace : float32 ``(m,)``; the last is seconds a metre
    """

    points: np.ndarray
    tangents: np.ndarray
    slopes: np.ndarray
    stroke: np.ndarray
    age: np.ndarray
    along: np.ndarray
    across: np.ndarray
    pace: np.ndarray


def guides_of(strokes: Sequence[Stroke]) -> Guides | None:
    """Return the points of ``strokes`` (metres, m/s) that guide; None if there are none."""
    known = [(n, stroke) for n, stroke in enumerate(strokes) if stroke.length > 0]
    if not known:
        return None
    dense = [resample(stroke, STEP) for _, stroke in known]
    tangents = [directions(stroke.points) for stroke in dense]
    row, places = in_a_row(dense)
    slopes = slopes_of(dense, tangents, row, places)
    counts = [len(stroke.points) for stroke in dense]
    ages = [flight_times(stroke) for stroke in dense]
    along = [
        np.linspace(0, stroke.length, count)
        for (_, stroke), count in zip(known, counts, strict=True)
    ]
    pace = [1 / np.maximum(np.linalg.norm(stroke.velocities, axis=1), 0.01) for stroke in dense]
    return Guides(
        joined([stroke.points for stroke in dense]),
        joined(tangents),
        joined(slopes),
        np.repeat([n for n, _ in known], counts).astype(np.int32),
        joined(ages),
        joined(along),
        np.repeat(places, counts).astype(np.float32),
        joined(pace),
    )


def joined(values: Sequence[np.ndarray]) -> np.ndarray:
    """Return the values of all strokes' points, float32."""
    return np.concatenate(values).astype(np.float32)


def directions(points: np.ndarray) -> np.ndarray:
    """Return the unit tangent at each point of a polyline, float64 ``(n, 3)``."""
    steps = np.gradient(points.astype(np.float64), axis=0)
    return np.asarray(steps / np.maximum(np.linalg.norm(steps, axis=1, keepdims=True), 1e-12))


def in_a_row(strokes: Sequence[Stroke]) -> tuple[list[int], np.ndarray]:
    """Return the strokes' numbers in a row, each beside the nearest left, and where each is, m.

    The row begins with a stroke at the edge. Places ``(n,)`` are by stroke: distances in the row,
    added up.
    """
    from scipy.spatial import cKDTree

    count = len(strokes)
    picked = [s.points[np.linspace(0, len(s.points) - 1, SAMPLES).astype(int)] for s in strokes]
    if count > MOST_ROWED:
        row = list(range(count))
    else:
        trees = [cKDTree(points) for points in picked]
        apart = np.array([[tree.query(points)[0].mean() for tree in trees] for points in picked])
        apart = apart + apart.T
        row, left = [int(apart[0].argmax())], set(range(count))
        while True:
            left.discard(row[-1])
            if not left:
                break
            row.append(min(left, key=lambda n: apart[row[-1], n]))
    places = np.zeros(count)
    for before, here in pairwise(row):
        gap = cKDTree(picked[before]).query(picked[here])[0].mean()
        places[here] = places[before] + gap
    return row, places


def slopes_of(
    strokes: Sequence[Stroke], tangents: Sequence[np.ndarray], row: Sequence[int],
    places: np.ndarray,
) -> list[np.ndarray]:  # fmt: skip
    """Return the gradient of *across* at each point of each stroke, ``(n, 3)``.

    It is such that the strokes on both sides have their own values; a stroke alone measures
    metres to one side.
    """
    from scipy.spatial import cKDTree

    trees = [cKDTree(stroke.points) for stroke in strokes]
    found: list[np.ndarray] = [np.zeros((0, 3))] * len(strokes)
    for place, n in enumerate(row):
        points, tangent = strokes[n].points.astype(np.float64), tangents[n]
        total = np.zeros_like(points)
        beside = [row[at] for at in (place - 1, place + 1) if 0 <= at < len(row)]
        for other in beside:
            to = strokes[other].points[trees[other].query(points)[1]] - points
            to -= (to * tangent).sum(axis=1, keepdims=True) * tangent
            gap = places[other] - places[n]
            square = np.maximum((to**2).sum(axis=1, keepdims=True), (gap / STEEPEST) ** 2)
            total += gap * to / np.maximum(square, 1e-12)
        if not beside:
            axis = np.eye(3)[np.abs(tangent.mean(axis=0)).argmin()]
            total = axis - (tangent @ axis)[:, None] * tangent
        found[n] = total / max(len(beside), 1)
    return found


def flow_coordinates(
    points: np.ndarray, strokes: Sequence[Stroke], colours: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """Return what is known of the flow at ``points`` float32 ``(n, 3)``, metres.

    colours : float32 ``(strokes, 4)``, linear; alpha 0 where a stroke has none.

    Returns float32 ``(n,)`` *age* (s), *along* and *across* (m), int32 ``(n,)`` *stroke*, -1
    without strokes, and with colours float32 ``(n, 4)`` *tint*, which goes over from one stroke's
    to the next in the middle third between them, and *tinted* ``(n,)``, its alpha.
    """
    guides = guides_of(strokes)
    count = len(points)
    values = np.zeros((count, 3), dtype=np.float32)
    tint = np.zeros((count, 4), dtype=np.float32)
    stroke = np.full(count, -1, dtype=np.int32)
    if guides is None:
        values[:, 0] = USUAL_AGE
    elif count:
        from scipy.spatial import cKDTree

        near = min(NEAREST, len(guides.points))
        tree = cKDTree(guides.points)
        away, nearest = tree.query(points, k=[*range(1, near + 1)], workers=-1)
        away, nearest = away.astype(np.float32), nearest.astype(np.int32)
        shown = np.zeros((len(strokes), 4)) if colours is None else colours
        own = np.ascontiguousarray(shown, dtype=np.float32)[guides.stroke]
        stroke = guides.stroke[nearest[:, 0]]
        held = (
            np.ascontiguousarray(points, dtype=np.float32), away, nearest, guides.points,
            guides.tangents, guides.slopes, guides.age, guides.along, guides.across, guides.pace,
            own, np.float32(STEP / 2),
        )  # fmt: skip
        in_parts(count, lambda a, b: _blend(a, b, *held, values, tint))
    found = {"age": values[:, 0], "along": values[:, 1], "across": values[:, 2], "stroke": stroke}
    if colours is None:
        return found
    share = tint[:, 3].copy()
    tint[:, :3] /= np.maximum(share[:, None], 1e-6)  # strokes without a colour were black
    return found | {"tint": tint, "tinted": share}


@njit(cache=True, fastmath=True)
def _blend(
    start, stop, points, away, nearest, places, tangents, slopes, age, along, across, pace, colours,
    soft, values, tint,
):  # fmt: skip
    """Write the blend of each point's nearest guides; the farthest has no weight."""
    near = away.shape[1]
    for v in range(start, stop):
        last = away[v, near - 1]
        least = np.float32(1) / (last * last + soft * soft)
        most = np.float32(1) / (away[v, 0] * away[v, 0] + soft * soft) - least
        most = max(most, np.float32(1e-12))
        total, sharp = np.float32(0), np.float32(0)
        for e in range(near):
            p = nearest[v, e]
            weight = np.float32(1) / (away[v, e] * away[v, e] + soft * soft) - least
            weight = weight / most + np.float32(1e-6)
            ahead, beside = np.float32(0), np.float32(0)
            for n in range(3):
                off = points[v, n] - places[p, n]
                ahead += off * tangents[p, n]
                beside += off * slopes[p, n]
            values[v, 0] += weight * (age[p] + ahead * pace[p])
            values[v, 1] += weight * (along[p] + ahead)
            values[v, 2] += weight * (across[p] + beside)
            total += weight
            strong = weight * weight * weight
            for n in range(4):
                tint[v, n] += strong * colours[p, n]
            sharp += strong
        for n in range(3):
            values[v, n] /= total
        values[v, 0] = max(values[v, 0], np.float32(0))
        for n in range(4):
            tint[v, n] /= sharp
