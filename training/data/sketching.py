# SPDX-License-Identifier: GPL-3.0-or-later
"""Streamlines of a frame, and the strokes that a user might draw for it (paper, 4.2.2)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from liquid_splash_addon.core.fluid.streamlines import representatives, seed_points, trace
from liquid_splash_addon.core.sketch.strokes import Stroke

from .frames import StoredFrame

TRACED = 160
"""Streamlines traced for one use of a frame."""

STROKE_DEPTH = 1.0
"""Cells under the surface from which on strokes follow it. What a user draws lies along the
liquid, and a hand's velocity along its stroke; a plain streamline leaves a moving sheet."""

STREAMLINE_REACH = 0.4
"""Metres that a streamline goes at most from its seed, each way: usually through the whole
splash, as people draw."""

PART_REACH = (0.05, 0.4)
"""Range of that reach where strokes show parts of streamlines only, metres."""

PARTLY = 0.3
"""Share of the training sketches whose strokes are such parts."""

KEPT_POINTS = 4
"""One in so many traced points is kept: two cells apart."""

FEWEST_LINES = 8
"""Streamlines that a frame must have to be kept."""

STROKES_IN_TRAINING = (1, 20)
STROKES_IN_TESTS = (5, 20)
"""Least and greatest number of strokes; the second is the paper's (4.2.2)."""

STROKE_JITTER = 0.002
"""Metres by which the strokes of the unsteadiest training sketch are moved: a slow wobble along
them, as of a hand. Others are moved less, most of them hardly: a network that is only shown strokes
that are off by half a sheet's thickness learns to trust none."""

SPEED_NOISE = 0.1
"""Relative error of a training stroke's speed."""


def trace_frame(
    frame: StoredFrame,
    spacing: float,
    rng: np.random.Generator,
    seeds: int = TRACED,
    parts: bool = False,
    plain: bool = False,
) -> list[np.ndarray]:
    """Return streamlines ``(m, 6)`` of a frame: metres from the box's corner, m/s.

    spacing : cell of the stored frame, metres; seeds : how many are traced; parts : cut each at a
    random length; plain : such parts, each from its seed on, which leave the liquid where the flow
    does instead of following the surface.
    """
    distance = frame.signed_distance
    points = seed_points(distance, seeds, rng)
    reach = (
        rng.uniform(*PART_REACH, len(points))
        if parts or plain
        else np.full(len(points), STREAMLINE_REACH)
    )
    skin = 0.0 if plain else STROKE_DEPTH
    lines = []
    for line in trace(
        distance, frame.block_velocity, points, reach / spacing, skin, both_ways=not plain
    ):
        thin = np.concatenate([line[:-1:KEPT_POINTS], line[-1:]])
        thin[:, :3] = (thin[:, :3] + frame.start) * spacing
        lines.append(thin.astype(np.float32))
    return lines


def draw_strokes(
    lines: Sequence[np.ndarray], rng: np.random.Generator, counts: tuple[int, int], jitter: bool
) -> list[Stroke]:
    """Return strokes that a user might have drawn for these streamlines.

    lines : ``(m, 6)`` each, metres and m/s. They are clustered down to a random number in
    ``counts``; the medoids are the strokes.
    """
    chosen = representatives(lines, int(rng.integers(counts[0], counts[1] + 1)))
    strokes = [Stroke(lines[i][:, :3], lines[i][:, 3:]) for i in chosen]
    if not jitter:
        return strokes
    size = STROKE_JITTER * rng.random() ** 3
    return [wobble(stroke, size, rng) for stroke in strokes]


def wobble(stroke: Stroke, size: float, rng: np.random.Generator) -> Stroke:
    """Return the stroke as an unsteady hand would draw it: slowly displaced, speed a bit off.

    size : standard deviation of the displacement, metres
    """
    offsets = rng.normal(0, size, (4, 3))
    where = np.linspace(0, 3, len(stroke.points))
    offset = np.stack([np.interp(where, np.arange(4), offsets[:, a]) for a in range(3)], axis=1)
    factor = 1 + SPEED_NOISE * rng.normal()
    return Stroke(stroke.points + offset, stroke.velocities * max(factor, 0.1))
