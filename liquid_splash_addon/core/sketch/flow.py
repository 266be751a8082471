# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist says of a stroke's speed after it was drawn: a factor, a profile, a direction."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..settings import Settings, setting
from .drawing import Drawing, backward
from .strokes import arc_length

SLOWEST = 0.01
"""Factor below which times are not stretched any more."""


def profile_setting(label: str, where: str) -> float:
    """Return the setting of a profile's factor at one place."""
    found: float = setting(
        1.0, label, f"Factor on the speed {where} of the stroke", low=0.0, high=10.0, soft=3.0
    )
    return found


@dataclass(frozen=True)
class Flow(Settings):
    """How a stroke flows, over how it was drawn. Speed is that of the hand by any source."""

    multiplier: float = setting(
        1.0, "Speed", "Factor on the speed at which the stroke was drawn",
        low=0.01, high=100.0, soft=4.0,
    )  # fmt: skip
    backward: bool = setting(
        False, "Flow Backward", "The liquid flows from the end of the stroke to its start",
        low=False, high=True,
    )  # fmt: skip
    start: float = profile_setting("Start", "at the start")
    middle: float = profile_setting("Middle", "in the middle")
    end: float = profile_setting("End", "at the end")

    @property
    def profile(self) -> tuple[float, float, float]:
        """Factors where the liquid starts, halfway, and where it ends."""
        return self.start, self.middle, self.end

    def applied(self, drawing: Drawing) -> Drawing:
        """Return what a drawing means: read the other way if need be, with factors on its speed."""
        if self.backward:
            drawing = backward(drawing)
        if self.multiplier == 1 and set(self.profile) == {1.0}:
            return drawing
        return replace(drawing, factors=self.factors(drawing.points))

    def factors(self, points: np.ndarray) -> np.ndarray:
        """Return the factor on the speed at each of ``points`` ``(n, 3)``, along the flow.

        Between start, middle and end they follow a monotone cubic (PCHIP): smooth, and never
        beyond the values at both sides.
        """
        from scipy.interpolate import PchipInterpolator

        along = arc_length(points)
        shares = along / along[-1] if along[-1] > 0 else np.zeros(len(points))
        profile = PchipInterpolator([0.0, 0.5, 1.0], self.profile)(shares)
        return np.asarray(self.multiplier * profile)


def as_if_drawn(drawing: Drawing) -> Drawing:
    """Return a drawing whose own times and speeds say what its factors say, for files."""
    if drawing.factors is None:
        return drawing
    factors = np.maximum(drawing.factors, SLOWEST)
    times, speeds = drawing.times, drawing.speeds
    if times is not None and len(times):
        steps = np.diff(times) / ((factors[1:] + factors[:-1]) / 2)
        times = times[0] + np.append(0.0, np.cumsum(steps))
    speeds = None if speeds is None else speeds * factors
    return replace(drawing, times=times, speeds=speeds, factors=None)
