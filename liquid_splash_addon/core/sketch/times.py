# SPDX-License-Identifier: GPL-3.0-or-later
"""Times of points, as recordings and edits leave them."""

from __future__ import annotations

import numpy as np


def continuous_times(times: np.ndarray) -> np.ndarray:
    """Make times ``(n,)`` never decrease, as they do in joined and in reversed strokes.

    A stroke whose direction was switched runs backward in time: it is read as if drawn the other
    way. Where two strokes were joined the times start again at zero: they go on instead.
    """
    if len(times) > 1 and times[-1] < times[0]:
        times = times[0] - times
    steps = np.diff(times)
    if not (steps < 0).any():
        return times
    forward = steps[steps > 0]
    steps[steps < 0] = np.median(forward) if len(forward) else 0.0
    return np.concatenate([times[:1], times[:1] + np.cumsum(steps)])
