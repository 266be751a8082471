# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes as another seed would have drawn them: a smooth random warp that grows along each stroke.

The generator's latent moves a surface by parts of a cell. What tells two splashes of one sketch
apart is where they reach: how far each stroke flies, and how it sways on the way. Both come from
random fields that are smooth in space, so that neighbouring strokes go together and still span the
same sheets; where a stroke begins, nothing moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..grid import LOCAL_CELLS, LOCAL_SPACING
from .strokes import Stroke, arc_length, resample

SWAY = 1.3 * LOCAL_SPACING
"""Root mean square by which the ends of strokes are moved at full variation, m."""

MOST_SWAY = 1.8 * LOCAL_SPACING
"""What no point is moved farther than, m."""

FARTHEST, SPREAD = 0.25, 0.18
"""Share of their length by which the strokes of the farthest seed fly on at full variation, in the
mean, and the spread between strokes."""

GOLDEN = (5**0.5 - 1) / 2
"""Its multiples, without what is before the point, lie evenly from 0 to 1: consecutive seeds differ
in how far they reach (a Weyl sequence)."""

SHORTEST, LONGEST = -0.03, 0.4
"""Share of its length by which a stroke may be shorter or longer: the drawn ones stay covered."""

WAVES = 8
"""Plane waves that a random field is the sum of."""

LEAST_WAVE, MOST_WAVE = 0.35, 0.9
"""Their lengths over the sketch's size."""

WALL = 4 * LOCAL_SPACING
"""Distance from the walls of the local box within which strokes are moved less, m."""


class SmoothField:
    """A smooth random field of mean 0 and variance 1 for each of its numbers."""

    def __init__(self, rng: np.random.Generator, size: float, numbers: int) -> None:
        """Draw it; size : of the sketch, m."""
        lengths = size * rng.uniform(LEAST_WAVE, MOST_WAVE, WAVES)
        ways = rng.standard_normal((WAVES, 3))
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        self.waves = 2 * np.pi * ways / lengths[:, None]
        self.phases = rng.uniform(0, 2 * np.pi, WAVES)
        self.heights = rng.standard_normal((WAVES, numbers)) * np.sqrt(2 / WAVES)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return its numbers ``(n, k)`` at points ``(n, 3)``, m."""
        return np.asarray(np.cos(points @ self.waves.T + self.phases) @ self.heights)


def varied(strokes: Sequence[Stroke], seed: int, variation: float) -> Sequence[Stroke]:
    """Return the strokes (local metres, m/s) of another splash of the same sketch.

    variation : 0 gives the strokes themselves, whatever the seed. Velocities turn and stretch as
    the strokes do.
    """
    if variation == 0:
        return strokes
    points = np.concatenate([stroke.points for stroke in strokes]).astype(np.float64)
    size = max(float(np.ptp(points, axis=0).max()), LOCAL_SPACING)
    rng = np.random.default_rng([seed, 3])
    sway, reach = SmoothField(rng, size, 3), SmoothField(rng, size, 1)
    farther = FARTHEST * (seed * GOLDEN % 1)
    ends = np.array([stroke.points[-1] for stroke in strokes], dtype=np.float64)
    shares = variation * np.clip(farther + SPREAD * reach.at(ends)[:, 0], SHORTEST, LONGEST)
    return [
        swayed(reaching(stroke, float(share)), sway, variation)
        for stroke, share in zip(strokes, shares, strict=True)
    ]


def reaching(stroke: Stroke, share: float) -> Stroke:
    """Return a stroke that is longer by a share of its length, straight on, or shorter."""
    length = stroke.length
    if length <= 0:
        return stroke
    dense = resample(stroke, LOCAL_SPACING / 2)
    along = arc_length(dense.points)
    if share < 0:
        kept = max(int(np.searchsorted(along, (1 + share) * length)), 2)
        return Stroke(dense.points[:kept], dense.velocities[:kept])
    back = max(len(along) - 5, 0)  # the last two cells: a hand's last point may jerk
    way = dense.points[-1].astype(np.float64) - dense.points[back]
    way /= max(float(np.linalg.norm(way)), 1e-12)
    steps = np.arange(1, int(share * length / (LOCAL_SPACING / 2)) + 1) * (LOCAL_SPACING / 2)
    more = dense.points[-1] + steps[:, None] * way
    more = more[np.abs(more).max(axis=1) < LOCAL_CELLS * LOCAL_SPACING / 2 - WALL]
    last = np.repeat(dense.velocities[-1:], len(more), axis=0)
    return Stroke(np.concatenate([dense.points, more]), np.concatenate([dense.velocities, last]))


def swayed(stroke: Stroke, field: SmoothField, variation: float) -> Stroke:
    """Return a stroke that is moved by a field, not at all where it begins.

    A point of the liquid moves along the path p(s) at ds/dt; its velocity changes by the change of
    the path's tangent times that.
    """
    points = stroke.points.astype(np.float64)
    along = arc_length(points)
    if along[-1] <= 0:
        return stroke
    inside = (LOCAL_CELLS * LOCAL_SPACING / 2 - np.abs(points).max(axis=1)) / WALL
    growth = variation * (along / along[-1]) * np.clip(inside, 0, 1)
    move = SWAY * growth[:, None] * field.at(points)
    far = np.linalg.norm(move, axis=1, keepdims=True)
    move *= MOST_SWAY * np.tanh(far / MOST_SWAY) / np.maximum(far, 1e-12)
    # Points that are equal have no direction: each gets a place of its own along the stroke.
    place = along + 1e-9 * along[-1] * np.arange(len(along))
    pace = np.gradient(points, place, axis=0)
    pace /= np.maximum(np.linalg.norm(pace, axis=1, keepdims=True), 1e-12)
    speed = (stroke.velocities * pace).sum(axis=1, keepdims=True)
    bend = np.gradient(move, place, axis=0)
    return replace(stroke, points=points + move, velocities=stroke.velocities + speed * bend)
