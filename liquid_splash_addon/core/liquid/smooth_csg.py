# SPDX-License-Identifier: GPL-3.0-or-later
"""Union and intersection of level sets, negative in the liquid, with a smooth joint."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def smooth_union(levels: Sequence[np.ndarray], blend: float) -> np.ndarray:
    """Return the smooth minimum of levels: of the lowest two, in whatever order they come.

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
    """Return the smooth maximum of two levels: the liquid in both, with a round edge."""
    return -smooth_union([-level, -other], width)
