# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file recorded, checked: nothing that is wrong goes on in silence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..sketch.drawing import Drawing
from ..sketch.strokes import arc_length
from ..sketch.times import continuous_times
from .limits import FARTHEST, StrokeFileError

FASTEST_HAND = 4.0
"""Mean speed of a stroke, m/s, from which recorded times are not believed. In real
recordings (docs/stroke-files.md) no stroke with plausible times has a mean above 2.5 m/s."""

FASTEST_MOUSE = 8.0
"""Median speed of a table, m/s, above which its units are probably others. Strokes of half a second
across a view of two metres, drawn with a mouse, have 4 to 5.5."""

SLOWEST_HAND = 1e-3
"""Median speed of a file, m/s, below which its unit of time is probably another."""


@dataclass(frozen=True)
class Recording:
    """The strokes of a file.

    Attributes
    ----------
    drawings : usable strokes, metres (z up) and seconds since each began
    warnings : sentences for the user, with counts
    median_speed : of all segments, m/s, as recorded; 0 where no times are
    """

    drawings: list[Drawing]
    warnings: list[str]
    median_speed: float

    @property
    def points(self) -> int:
        """Number of points of all strokes."""
        return sum(len(drawing.points) for drawing in self.drawings)

    @property
    def size(self) -> float:
        """Longest side of the box along the axes, metres."""
        low = np.min([drawing.points.min(axis=0) for drawing in self.drawings], axis=0)
        high = np.max([drawing.points.max(axis=0) for drawing in self.drawings], axis=0)
        return float((high - low).max())

    @property
    def summary(self) -> str:
        """Describe it in one line."""
        speed = f", {self.median_speed:.2g} m/s" if self.median_speed > 0 else ""
        return f"{len(self.drawings):,} strokes, {self.points:,} points, {self.size:.2g} m{speed}"


def segment_speeds(drawings: Sequence[Drawing]) -> np.ndarray:
    """Return the raw speed of each segment that takes time, all strokes together, ``(n,)``."""
    found = [np.zeros(0)]
    for drawing in drawings:
        if drawing.times is not None:
            lengths = np.linalg.norm(np.diff(drawing.points, axis=0), axis=1)
            steps = np.diff(drawing.times)
            found.append(lengths[steps > 0] / steps[steps > 0])
    return np.concatenate(found)


def checked(drawings: Sequence[Drawing], warnings: Sequence[str], by_hand: bool) -> Recording:
    """Return what can be used of the strokes that a reader found, and say what was wrong.

    by_hand : whether times that make strokes faster than a hand are wrong for sure
    Raises StrokeFileError where nothing can be used.
    """
    said = list(warnings)
    kept = without_faults(drawings, said)
    kept = in_order(kept, said)
    speeds = segment_speeds(kept)
    median = float(np.median(speeds)) if len(speeds) else 0.0
    kept = at_hand_speed(kept, median, said) if by_hand else kept
    if not by_hand and median > FASTEST_MOUSE:
        said.append(f"The strokes move at {median:.3g} m/s in the median, faster than one draws: "
                    "check the units of length and time")  # fmt: skip
    if 0 < median < SLOWEST_HAND:
        said.append(f"The strokes move at {1000 * median:.2g} mm/s in the median: "
                    "check the units of length and time")  # fmt: skip
    untimed = sum(not drawing.is_timed and drawing.speeds is None for drawing in kept)
    if untimed:
        said.append(f"{untimed:,} of {len(kept):,} strokes have no recorded time that can be used: "
                    "their speed is the setting Stroke Speed")  # fmt: skip
    return Recording(kept, said, median)


def without_faults(drawings: Sequence[Drawing], said: list[str]) -> list[Drawing]:
    """Leave out points that are no numbers, and then strokes without length."""
    kept, lost, short = [], 0, 0
    for drawing in drawings:
        good = np.isfinite(drawing.points).all(axis=1)
        good &= (np.abs(drawing.points) <= FARTHEST).all(axis=1)
        for values in (drawing.times, drawing.pressures, drawing.speeds):
            good &= True if values is None else np.isfinite(values)
        lost += len(good) - int(good.sum())
        part = picked(drawing, good)
        if len(part.points) > 1 and arc_length(part.points.astype(np.float32))[-1] > 0:
            kept.append(part)
        else:
            short += 1
    if lost:
        said.append(f"{lost:,} points have a value that is not a number, or lie over "
                    f"{FARTHEST / 1000:,.0f} km away: left out")  # fmt: skip
    if not kept:
        raise StrokeFileError(
            f"None of the {len(drawings):,} strokes in the file has a length: nothing was drawn"
        )
    if short:
        said.append(f"{short:,} of {len(drawings):,} strokes have no length: left out")
    return kept


def picked(drawing: Drawing, good: np.ndarray) -> Drawing:
    """Return the points of a drawing that are ``good``, pressures and speeds in their ranges."""
    times, pressures, speeds = (
        None if values is None else np.asarray(values, dtype=np.float64)[good]
        for values in (drawing.times, drawing.pressures, drawing.speeds)
    )
    return Drawing(
        np.asarray(drawing.points, dtype=np.float64)[good],
        times,
        None if pressures is None else pressures.clip(0.0, 1.0),
        None if speeds is None else np.abs(speeds),
    )


def in_order(drawings: Sequence[Drawing], said: list[str]) -> list[Drawing]:
    """Have times begin at zero and never fall; None where they are all equal."""
    kept, fallen, strokes, equal = [], 0, 0, 0
    for drawing in drawings:
        if drawing.times is None or not drawing.is_timed:
            kept.append(replace(drawing, times=None))
            continue
        times, steps = drawing.times, np.diff(drawing.times)
        equal += int((steps == 0).sum())
        if falls := int((steps < 0).sum()):
            fallen, strokes = fallen + falls, strokes + 1
            times = continuous_times(times)
        kept.append(replace(drawing, times=times - times[0]))
    kept = [d if d.times is None or d.is_timed else replace(d, times=None) for d in kept]
    if fallen:
        said.append(f"Times fall {fallen:,} times, in {strokes:,} strokes: each fall was replaced "
                    "by the stroke's usual step")  # fmt: skip
    if equal:
        said.append(f"{equal:,} points have the time of the point before: speed is the mean over "
                    "a stretch around them")  # fmt: skip
    return kept


def at_hand_speed(drawings: Sequence[Drawing], median: float, said: list[str]) -> list[Drawing]:
    """Drop times that make a stroke faster than a hand: edited, or drawn at a zoom not stored."""
    if median > FASTEST_HAND:
        said.append(f"The recorded times make the strokes {median:.3g} m/s fast in the median, "
                    "which no hand is: they are not used (the zoom was not stored, or the times "
                    "were edited)")  # fmt: skip
        return [replace(drawing, times=None) for drawing in drawings]
    fast = [mean_speed(drawing) > FASTEST_HAND for drawing in drawings]
    if any(fast):
        said.append(f"The recorded times make {sum(fast):,} of {len(drawings):,} strokes faster "
                    f"than {FASTEST_HAND:g} m/s, which no hand is: they are not used")  # fmt: skip
    return [
        replace(d, times=None) if is_fast else d for d, is_fast in zip(drawings, fast, strict=True)
    ]


def mean_speed(drawing: Drawing) -> float:
    """Return length over time; 0 where there are no times."""
    if drawing.times is None or not drawing.is_timed:
        return 0.0
    return float(arc_length(drawing.points)[-1] / np.ptp(drawing.times))


def size_warnings(recording: Recording, real_size: float) -> list[str]:
    """Warn where a recording has another size than its splash, which changes its speeds too.

    real_size : longest side of the splash, metres; 0: as recorded
    """
    factor = real_size / recording.size if real_size > 0 else 1.0
    if 1 / 3 < factor < 3:
        return []
    change = f"{factor:.0f} times larger" if factor > 1 else f"{1 / factor:.0f} times smaller"
    pace = "faster" if factor > 1 else "slower"
    return [
        f"The strokes are {recording.size:.2g} m across. At a Real Size of {real_size:g} m the "
        f"splash is {change}, and as much {pace}: change Real Size or Speed Gain"
    ]
