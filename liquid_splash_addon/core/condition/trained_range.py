# SPDX-License-Identifier: GPL-3.0-or-later
"""What strokes the generator was trained on, and where a sketch leaves that range.

Measured by `python -m training ranges` on sketches of training frames, see SHARPEST and FARTHEST.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..grid import Grid
from ..sketch.strokes import Stroke, arc_length, resample

STEP = 0.006
"""Metres between the points at which strokes are measured."""

ARM = 0.01
"""Metres before and after a point whose directions make the angle that a stroke turns by there."""

SHARPEST = 1.25
"""Radians that strokes turn by over two ARMs: 999 in 1000 points of 120 training sketches turn
less (1.26), 99 in 100 less than 0.94."""

FARTHEST = 0.23
"""Metres to the nearest other stroke: 99 in 100 points are nearer (0.235). Farther ones are those
of sketches of two or three strokes; patches reach no farther than 0.16."""

FAST, SHARP, LONELY, OUTSIDE = 1, 2, 4, 8
"""Bits of what is wrong with a point, see :func:`faults_of`."""

ABOUT = {
    FAST: "faster than {fastest:.1f} m/s",
    SHARP: "bent sharply",
    LONELY: "far from other strokes",
    OUTSIDE: "left its splash",
}
"""What each of them is called."""


class Measures(NamedTuple):
    """What matters of a stroke at each point, ``(n,)`` each.

    speed : m/s; turning : radians over two ARMs; spacing : metres to the nearest other stroke,
    infinite where there is none; inside : whether it is in the generator's box
    """

    speed: np.ndarray
    turning: np.ndarray
    spacing: np.ndarray
    inside: np.ndarray


def measured(strokes: Sequence[Stroke]) -> list[tuple[Stroke, Measures]]:
    """Return strokes (local metres, m/s), resampled at STEP, with their measures."""
    fine = [resample(stroke, STEP) for stroke in strokes]
    spacings = distances_to_others([stroke.points for stroke in fine])
    box = Grid.local()
    return [
        (
            stroke,
            Measures(
                np.linalg.norm(stroke.velocities, axis=1),
                turning(stroke.points.astype(np.float64)),
                spacing,
                box.contains(stroke.points),
            ),
        )
        for stroke, spacing in zip(fine, spacings, strict=True)
    ]


def faults_of(measures: Measures, fastest: float) -> np.ndarray:
    """Return what is outside the training's range at each point, as bits, int ``(n,)``.

    fastest : speed up to which the generator was trained, m/s
    """
    alone = np.isinf(measures.spacing)  # single strokes are trained on
    return np.asarray(
        FAST * (measures.speed > fastest)
        + SHARP * (measures.turning > SHARPEST)
        + LONELY * ((measures.spacing > FARTHEST) & ~alone)
        + OUTSIDE * ~measures.inside
    )


def in_words(fault: int, fastest: float) -> str:
    """Name one of FAST, SHARP, LONELY and OUTSIDE."""
    return ABOUT[fault].format(fastest=fastest)


def turning(points: np.ndarray) -> np.ndarray:
    """Return by how much a polyline ``(n, 3)`` turns around each point, radians ``(n,)``.

    It is the angle between the chords of ARM before and after the point. Near the ends it is that
    of the nearest point with both chords; a stroke shorter than that is straight.
    """
    along = arc_length(points)
    if along[-1] <= 2 * ARM:
        return np.zeros(len(points))
    middle = np.clip(along, ARM, along[-1] - ARM)
    before, here, after = (
        np.stack([np.interp(place, along, axis) for axis in points.T], axis=1)
        for place in (middle - ARM, middle, middle + ARM)
    )
    arms = [here - before, after - here]
    sizes = [np.maximum(np.linalg.norm(arm, axis=1), 1e-12) for arm in arms]
    cosine = (arms[0] * arms[1]).sum(axis=1) / (sizes[0] * sizes[1])
    return np.asarray(np.arccos(np.clip(cosine, -1, 1)))


def distances_to_others(polylines: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return each point's distance to the nearest point of another polyline, ``(n,)`` each.

    Infinite where there is no other.
    """
    from scipy.spatial import cKDTree

    if len(polylines) < 2:
        return [np.full(len(points), np.inf) for points in polylines]
    together = np.concatenate(polylines)
    owner = np.repeat(np.arange(len(polylines)), [len(points) for points in polylines])
    # Among so many neighbours there is one of another polyline.
    count = max(len(points) for points in polylines) + 1
    distances, numbers = cKDTree(together).query(together, k=count)
    is_other = owner[numbers] != owner[:, None]
    first = is_other.argmax(axis=1)
    nearest = distances[np.arange(len(together)), first]
    return np.split(nearest, np.cumsum([len(points) for points in polylines])[:-1])
