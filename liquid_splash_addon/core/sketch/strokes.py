# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes: polylines with a velocity at every point (paper, 4.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


class StrokeError(ValueError):
    """Strokes that no splash can be made of; the message says what to do."""


@dataclass(frozen=True)
class Stroke:
    """A drawn streamline.

    Attributes
    ----------
    points : float32 ``(n, 3)``
    velocities : float32 ``(n, 3)``, in the unit of the points per second
    """

    points: np.ndarray
    velocities: np.ndarray

    def __post_init__(self) -> None:
        for name in ("points", "velocities"):
            array = np.asarray(getattr(self, name), dtype=np.float32)
            object.__setattr__(self, name, array)
            if array.ndim != 2 or array.shape[1] != 3:
                raise StrokeError(f"a stroke's {name} must have shape (n, 3), not {array.shape}")
        if len(self.points) != len(self.velocities):
            raise StrokeError(
                f"a stroke needs one velocity a point: {len(self.points)} points, "
                f"{len(self.velocities)} velocities"
            )

    @property
    def length(self) -> float:
        """Length of the polyline, in the unit of the points."""
        return float(arc_length(self.points)[-1]) if len(self.points) else 0.0


def arc_length(points: np.ndarray) -> np.ndarray:
    """Return the distance along the polyline ``(n, 3)`` at each point, float64 ``(n,)``."""
    steps = np.linalg.norm(np.diff(points.astype(np.float64), axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def check_strokes(strokes: Sequence[Stroke]) -> None:
    """Raise :class:`StrokeError` with advice if no splash can be made of ``strokes``."""
    if not strokes:
        raise StrokeError("Draw at least one stroke first")
    for number, stroke in enumerate(strokes, start=1):
        if len(stroke.points) < 2:
            raise StrokeError(
                f"Stroke {number} has {len(stroke.points)} point(s): a stroke needs at least "
                "two; remove it or draw a longer one"
            )
        if not (np.isfinite(stroke.points).all() and np.isfinite(stroke.velocities).all()):
            raise StrokeError(
                f"Stroke {number} has a position or velocity that is not a number: remove it"
            )
        if stroke.length <= 0:
            raise StrokeError(
                f"Stroke {number} has no length (all its points are equal): remove it "
                "or draw a longer one"
            )


def resample(stroke: Stroke, step: float) -> Stroke:
    """Return ``stroke`` with points at most ``step`` apart, evenly along its length.

    Both ends are kept; velocities are interpolated linearly along the arc. The number of
    points is ``ceil(length / step) + 1``.
    """
    from .polyline import interpolated  # compiles: not when the add-on is registered

    along = arc_length(stroke.points)
    count = max(int(np.ceil(along[-1] / step - 1e-6)), 1) + 1
    table = np.hstack([stroke.points, stroke.velocities]).astype(np.float64)
    dense = interpolated(np.linspace(0.0, along[-1], count), along, table)
    return Stroke(dense[:, :3], dense[:, 3:])


def resampled_points(strokes: Sequence[Stroke], step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points and velocities, float32 ``(n, 3)``, of all strokes resampled at ``step``."""
    dense = [resample(stroke, step) for stroke in strokes]
    points = np.concatenate([stroke.points for stroke in dense])
    return points, np.concatenate([stroke.velocities for stroke in dense])
