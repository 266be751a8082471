# SPDX-License-Identifier: GPL-3.0-or-later
"""Level sets, negative in the liquid, smooth_union or smooth_maximum with a smooth joint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def smooth_union(levels: Sequence[np.ndarray], blend: float) -> np.ndarray:
    """Return the smooth minimum of levels: that of the lowest two, whatever their order.

    Quilez's quadratic: lower than the minimum by ``blend`` / 4 where both are equal, and not at
    all where they differ by ``blend``.
    """
    lowest = np.minimum.reduce(levels)
    if blend == 0 or len(levels) == 1:
        return lowest
    second = np.partition(np.stack(levels), 1, axis=0)[1]
    overlap = np.maximum(blend - (second - lowest), 0.0) / blend
    return np.asarray(lowest - blend / 4 * overlap**2, dtype=np.float32)


def smooth_maximum(level: np.ndarray, other: np.ndarray, width: float) -> np.ndarray:
    """Return the smooth maximum of two levels: the liquid that is in both, round at its edge."""
    return -smooth_union([-level, -other], width)
