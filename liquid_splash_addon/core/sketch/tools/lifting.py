# SPDX-License-Identifier: GPL-3.0-or-later
"""Lift: depth for strokes that were drawn flat, in one view."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...settings import setting
from ..drawing import Drawing
from ..local_frame import principal_axes
from .tool import FLAT, Derived, Place, StrokeTool, moved_to, shares_along, size_of


@dataclass(frozen=True)
class Lift(StrokeTool):
    """Strokes leave the plane that they were drawn in. Depths are shares of the sketch's size."""

    label: ClassVar[str] = "Lift"
    about: ClassVar[str] = (
        "Give depth to a flat sketch: bend it along the flow, alternate strokes forward and back, "
        "or lift them by pressure"
    )

    direction: str = setting(
        "PLANE", "Direction", "Which way strokes are lifted",
        items=(
            ("PLANE", "From the Sketch", "Out of the plane that the strokes lie in, to the viewer"),
            ("VIEW", "View", "Towards the viewer"),
            *((name, name, f"Along the {name} axis") for name in "XYZ"),
        ),
    )  # fmt: skip
    bend: float = setting(
        0.15, "Bend", "How far the ends of strokes are bent out of the plane, share of the "
        "sketch's size", low=-2.0, high=2.0,
    )  # fmt: skip
    alternate: float = setting(
        0.15, "Alternate", "How far neighbours part, one forward, the next back, share of the "
        "sketch's size", low=-2.0, high=2.0,
    )  # fmt: skip
    pressure: float = setting(
        0.0, "Pressure", "How far the thickest points are in front of points without thickness, "
        "share of the sketch's size", low=-2.0, high=2.0,
    )  # fmt: skip

    def apply(self, strokes: Sequence[Drawing], place: Place) -> list[Derived]:
        """Return the strokes, lifted: from their starts on, the farther the more."""
        direction, size = self.lift_direction(strokes, place), size_of(strokes)
        thickest = max(
            (float(s.pressures.max()) for s in strokes if s.pressures is not None), default=0.0
        )
        signs = alternating(strokes, direction)
        made = []
        for number, (stroke, sign) in enumerate(zip(strokes, signs, strict=True)):
            depth = (self.bend + sign * self.alternate) * shares_along(stroke.points) ** 2
            if stroke.pressures is not None and thickest > 0:
                depth = depth + self.pressure * stroke.pressures / thickest
            lifted = stroke.points + size * depth[:, None] * direction
            places = np.arange(len(lifted), dtype=np.float64)
            made.append(Derived(moved_to(stroke, lifted), number, places))
        return made

    def lift_direction(self, strokes: Sequence[Drawing], place: Place) -> np.ndarray:
        """Return the unit vector ``(3,)`` along which strokes are lifted."""
        if self.direction in "XYZ":
            return place.axes["XYZ".index(self.direction)]
        towards = place.towards
        if self.direction == "VIEW" and towards is not None:
            return towards
        normal = normal_of(strokes, towards)
        if towards is not None and normal @ towards < 0:
            return -normal
        return normal


def normal_of(strokes: Sequence[Drawing], towards: np.ndarray | None) -> np.ndarray:
    """Return the unit normal ``(3,)`` of the plane in which strokes lie.

    Strokes in a line have none: it is across them, towards the viewer where there is one, else up.
    """
    together = np.concatenate([stroke.points for stroke in strokes])
    _, axes, variances = principal_axes(together)
    if variances[1] > (FLAT**2) * variances[0]:
        normal = axes[2]
        # The sign of an eigenvector says nothing: without a view, to the side of the largest part.
        return np.asarray(normal * np.sign(normal[np.argmax(np.abs(normal))]))
    along = axes[0]
    for candidate in (towards, np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])):
        if candidate is None:
            continue
        across = candidate - (candidate @ along) * along
        if np.linalg.norm(across) > 0.1:
            break
    return np.asarray(across / np.linalg.norm(across))


def alternating(strokes: Sequence[Drawing], normal: np.ndarray) -> np.ndarray:
    """Return +1 or -1 for each stroke, neighbours unlike, by their order across the flow.

    normal : unit vector ``(3,)`` that the strokes are seen along
    """
    middles = np.array([stroke.points.mean(axis=0) for stroke in strokes])
    flow = np.sum([stroke.points[-1] - stroke.points[0] for stroke in strokes], axis=0)
    across = np.cross(normal, flow)
    if np.linalg.norm(across) <= FLAT * size_of(strokes):  # flows cancel: by their order in space
        across = principal_axes(middles)[1][0]
    order = np.argsort(middles @ across, kind="stable")
    signs = np.empty(len(strokes))
    signs[order] = 1.0 - 2.0 * (np.arange(len(strokes)) % 2)
    return signs
