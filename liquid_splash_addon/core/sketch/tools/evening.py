# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools on each stroke alone: Resample and Smooth, Reverse."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...settings import setting
from ..drawing import Drawing, backward
from ..strokes import arc_length
from .tool import Derived, Place, StrokeTool, moved_to, places_along, sampled_at

MOST_POINTS = 10_000
"""Points that a stroke may get."""

WIDEST = 0.1
"""Share of a stroke's length over which smoothing 1 takes means: a Gaussian's deviation."""


@dataclass(frozen=True)
class Resample(StrokeTool):
    """Points evenly along each stroke, and the tremor of the hand taken out."""

    label: ClassVar[str] = "Resample and Smooth"
    about: ClassVar[str] = "Space points evenly along each stroke, and smooth it; speeds stay"

    by: str = setting(
        "COUNT", "By", "What is given",
        items=(
            ("COUNT", "Points", "How many points each stroke gets"),
            ("SPACING", "Spacing", "How far apart the points are"),
        ),
    )  # fmt: skip
    count: int = setting(48, "Points", "Points of each stroke", low=2, high=MOST_POINTS, soft=200)
    spacing: float = setting(
        0.05, "Spacing", "Longest distance between points, in Blender units",
        low=1e-4, high=1000.0, soft=1.0,
    )  # fmt: skip
    smooth: float = setting(
        0.1, "Smooth", "How much of the tremor is taken out; the ends stay in place. At 1, means "
        "are taken over a tenth of the stroke", low=0.0, high=1.0,
    )  # fmt: skip

    def apply(self, strokes: Sequence[Drawing], place: Place) -> list[Derived]:
        """Return the strokes with points evenly along them, then smoothed."""
        made = []
        for number, stroke in enumerate(strokes):
            count = self.count
            if self.by == "SPACING":
                length = float(arc_length(stroke.points)[-1])
                count = min(int(np.ceil(length / self.spacing - 1e-6)) + 1, MOST_POINTS)
            places = places_along(stroke.points, np.linspace(0, 1, max(count, 2)))
            even = sampled_at(stroke, places)
            smoothed = moved_to(even, smoothed_path(even.points, self.smooth * WIDEST))
            made.append(Derived(smoothed, number, places))
        return made


@dataclass(frozen=True)
class Reverse(StrokeTool):
    """Strokes drawn the other way."""

    label: ClassVar[str] = "Reverse"
    about: ClassVar[str] = "Let strokes flow the other way, at each place as fast as before"

    def apply(self, strokes: Sequence[Drawing], place: Place) -> list[Derived]:
        """Return the strokes from their ends to their starts."""
        return [
            Derived(backward(stroke), number, np.arange(len(stroke.points))[::-1].astype(float))
            for number, stroke in enumerate(strokes)
        ]


def smoothed_path(points: np.ndarray, width: float) -> np.ndarray:
    """Return evenly spaced ``points`` ``(n, 3)`` smoothed by a Gaussian; both ends stay.

    width : its deviation, share of the length

    It is made of binomial passes (1, 2, 1) / 4, each of which adds half a squared spacing to the
    variance. With both ends held, its waves are sines about the chord; one that turns by k radians
    a point is damped to cos(k / 2)^2 in each pass.
    """
    from scipy.fft import dst, idst

    last = len(points) - 1
    passes = 2 * (width * last) ** 2
    if last < 2 or passes <= 0:
        return points
    share = (np.arange(last + 1) / last)[:, None]
    chord = points[:1] + share * (points[-1:] - points[:1])
    turns = np.pi * np.arange(1, last) / last
    damping = np.cos(turns / 2)[:, None] ** (2 * passes)
    inner = idst(damping * dst((points - chord)[1:-1], type=1, axis=0), type=1, axis=0)
    smooth = points.copy()
    smooth[1:-1] = chord[1:-1] + inner
    return smooth
