# SPDX-License-Identifier: GPL-3.0-or-later
"""The gain by which a sketch moves as splashes do: hands draw fast or slow, as they like."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .strokes import Stroke

TYPICAL = 0.4
"""Speed of the median stroke after fitting, over the fastest that the generator knows."""

QUANTILE = 0.95
"""Share of the points that must not be faster than that: recorded times are never perfect."""


def fitting_gain(strokes: Sequence[Stroke], fastest: float) -> float:
    """Return the gain at which the median stroke is as fast as splashes are.

    strokes : local metres and m/s, before any gain
    fastest : m/s, the fastest speed that the generator knows
    ValueError where nothing moves.
    """
    speeds = [np.linalg.norm(stroke.velocities, axis=1) for stroke in strokes]
    middle = float(np.median([np.median(one) for one in speeds]))
    high = float(np.quantile(np.concatenate(speeds), QUANTILE))
    if not (middle > 0 and np.isfinite(high)):
        raise ValueError("The strokes do not move: draw them again, or choose a constant speed")
    return float(min(TYPICAL * fastest / middle, fastest / high))
