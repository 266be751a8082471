# SPDX-License-Identifier: GPL-3.0-or-later
"""What tools on strokes share: what they are given, what they make, and speeds that stay right.

All points are in one space, that of the world. Of a Drawing's pressures only the ratios count here:
they may be radii.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from ...settings import Settings, setting
from ..drawing import Drawing
from ..strokes import arc_length

FLAT = 1e-4
"""Share of a sketch's size below which a distance is none."""


class Place(NamedTuple):
    """Where a tool works.

    Attributes
    ----------
    pivot : float64 ``(3,)``, the point that axes and planes go through
    axes : float64 ``(3, 3)``, rows are unit x, y and z of the space that the artist chose
    towards : float64 ``(3,)``, unit vector to the viewer; None without a view
    """

    pivot: np.ndarray = np.zeros(3)
    axes: np.ndarray = np.eye(3)
    towards: np.ndarray | None = None


class Derived(NamedTuple):
    """A stroke that a tool made.

    Attributes
    ----------
    drawing : the stroke
    source : number of the stroke that it takes all other properties from
    places : float64 ``(n,)``, for each point where on the source it comes from, in points
    """

    drawing: Drawing
    source: int
    places: np.ndarray


@dataclass(frozen=True)
class StrokeTool(Settings):
    """A tool: its settings, and what it does to strokes.

    Attributes
    ----------
    label, about : for menus and tooltips; about is a sentence without its full stop
    fewest : strokes that it needs
    """

    label: ClassVar[str]
    about: ClassVar[str]
    fewest: ClassVar[int] = 1

    @property
    def keeps_strokes(self) -> bool:
        """Whether the strokes stay and what is made is added; else it replaces them."""
        return False

    def apply(self, strokes: Sequence[Drawing], place: Place) -> list[Derived]:
        """Return what becomes of ``strokes``, each of two points or more and of some length."""
        raise NotImplementedError


def axis_setting(default: str, description: str) -> str:
    """Return the setting of an axis of the chosen space."""
    items = tuple((name, name, f"The {name} axis") for name in "XYZ")
    found: str = setting(default, "Axis", description, items=items)
    return found


def sampled_at(drawing: Drawing, places: np.ndarray) -> Drawing:
    """Return a drawing at ``places`` ``(m,)``, in points; linear between points."""
    numbers = np.arange(len(drawing.points))

    def column(values: np.ndarray | None) -> np.ndarray | None:
        return None if values is None else np.interp(places, numbers, values)

    points = np.stack([np.interp(places, numbers, axis) for axis in drawing.points.T], axis=1)
    times, pressures, speeds = map(column, (drawing.times, drawing.pressures, drawing.speeds))
    return Drawing(points, times, pressures, speeds)


def places_along(points: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return the places ``(m,)``, in points, at ``shares`` ``(m,)`` of a stroke's length."""
    along = arc_length(points)
    return np.interp(np.asarray(shares) * along[-1], along, np.arange(len(points)))


def shares_along(points: np.ndarray) -> np.ndarray:
    """Return how much of a stroke's length lies before each point, ``(n,)`` from 0 to 1."""
    along = arc_length(points)
    return along / along[-1]


def moved_to(drawing: Drawing, points: np.ndarray) -> Drawing:
    """Return a drawing with its points ``(n, 3)`` elsewhere.

    Times stay, so a longer stroke is a faster one, and stored speeds say the same as times.
    """
    if drawing.speeds is None:
        return replace(drawing, points=points)
    before, after = (lengths_around(path) for path in (drawing.points, points))
    stretch = after / np.where(before > 0, before, 1.0)
    return replace(drawing, points=points, speeds=drawing.speeds * np.where(before > 0, stretch, 1))


def lengths_around(points: np.ndarray) -> np.ndarray:
    """Return the length of the segments that meet at each point ``(n,)``."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.append(steps, 0.0) + np.append(0.0, steps)


def hastened(drawing: Drawing, factor: float) -> Drawing:
    """Return a drawing drawn ``factor`` times as fast."""
    times = None if drawing.times is None else drawing.times / factor
    return replace(
        drawing, times=times, speeds=None if drawing.speeds is None else drawing.speeds * factor
    )


def size_of(strokes: Sequence[Drawing]) -> float:
    """Return the longest side of the box around all strokes, along the world's axes."""
    return float(np.ptp(np.concatenate([stroke.points for stroke in strokes]), axis=0).max())
