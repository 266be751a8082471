# SPDX-License-Identifier: GPL-3.0-or-later
"""Fill: strokes between strokes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...settings import setting
from ..drawing import Drawing, backward
from .tool import Derived, Place, StrokeTool, places_along, sampled_at

Sampled = tuple[Drawing, np.ndarray]
"""A stroke with as many points as the others, and their places on it."""


@dataclass(frozen=True)
class Fill(StrokeTool):
    """Strokes between each stroke and the next."""

    label: ClassVar[str] = "Fill"
    about: ClassVar[str] = (
        "Add strokes between two strokes, or between each stroke and the next in the order in "
        "which they were drawn"
    )
    fewest: ClassVar[int] = 2

    count: int = setting(2, "Between", "Strokes between two", low=1, high=64, soft=16)
    close: bool = setting(
        False, "Close", "Also between the last stroke and the first, as around a crown",
        low=False, high=True,
    )  # fmt: skip
    rounded: bool = setting(
        True, "Round", "Follow a smooth curve through three strokes or more instead of straight "
        "lines from each to the next", low=False, high=True,
    )  # fmt: skip
    match: bool = setting(
        True, "Match Directions", "Where two strokes run against each other, read the second the "
        "other way round", low=False, high=True,
    )  # fmt: skip

    @property
    def keeps_strokes(self) -> bool:
        """Strokes are added."""
        return True

    def apply(self, strokes: Sequence[Drawing], place: Place) -> list[Derived]:
        """Return the strokes between; all with as many points as the stroke that has most."""
        rows = self.matched(strokes)
        closes = self.close and len(rows) > 2
        shares = np.arange(1, self.count + 1) / (self.count + 1)
        made = []
        for first in range(len(rows) if closes else len(rows) - 1):
            for share in shares:
                weights = self.weights(first, share, len(rows), closes)
                nearer = first if share <= 0.5 else (first + 1) % len(rows)
                made.append(Derived(blended(rows, weights), nearer, rows[nearer][1]))
        return made

    def matched(self, strokes: Sequence[Drawing]) -> list[Sampled]:
        """Return the strokes with one number of points, evenly along each, running alike."""
        shares = np.linspace(0, 1, max(len(stroke.points) for stroke in strokes))
        rows: list[Sampled] = []
        for stroke in strokes:
            places = places_along(stroke.points, shares)
            row = sampled_at(stroke, places)
            if self.match and rows and runs_against(row.points, rows[-1][0].points):
                row, places = backward(row), places[::-1]
            rows.append((row, places))
        return rows

    def weights(self, first: int, share: float, count: int, closes: bool) -> np.ndarray:
        """Return the weights ``(count,)`` of all strokes, ``share`` of the way after one of them.

        Rounded they are those of a Catmull-Rom spline; beyond the ends of an open row it goes
        straight on.
        """
        found = np.zeros(count)
        if not self.rounded:
            np.add.at(found, [first, (first + 1) % count], [1 - share, share])
            return found
        s = share
        spline = 0.5 * np.array([
            -s + 2 * s**2 - s**3,
            2 - 5 * s**2 + 3 * s**3,
            s + 4 * s**2 - 3 * s**3,
            -(s**2) + s**3,
        ])  # fmt: skip
        for offset, weight in zip(range(-1, 3), spline, strict=True):
            number = first + offset
            if closes or 0 <= number < count:
                found[number % count] += weight
            else:  # a stroke as far beyond the end as its neighbour is before it
                end, inner = (0, 1) if number < 0 else (count - 1, count - 2)
                found[end] += 2 * weight
                found[inner] -= weight
        return found


def runs_against(points: np.ndarray, others: np.ndarray) -> bool:
    """Whether a stroke ``(n, 3)`` is nearer to another ``(n, 3)`` when read backwards."""
    ahead = np.linalg.norm(points - others, axis=1).sum()
    return bool(np.linalg.norm(points[::-1] - others, axis=1).sum() < ahead)


def blended(rows: Sequence[Sampled], weights: np.ndarray) -> Drawing:
    """Return the weighted mean of strokes of one number of points; weights sum to 1.

    Times are None unless all have some, and so on. A spline through them may swing past the ends
    of what is possible: times never go back, thickness and speed are never negative.
    """

    def mean(name: str) -> np.ndarray | None:
        values = [getattr(row, name) for row, _ in rows]
        if any(v is None for v, weight in zip(values, weights, strict=True) if weight):
            return None
        used = [(v, w) for v, w in zip(values, weights, strict=True) if w]
        return np.asarray(sum(weight * value for value, weight in used))

    points, times, pressures, speeds = map(mean, ("points", "times", "pressures", "speeds"))
    assert points is not None
    times = None if times is None else np.maximum.accumulate(times)
    pressures, speeds = (None if v is None else np.maximum(v, 0.0) for v in (pressures, speeds))
    return Drawing(points, times, pressures, speeds)
