# SPDX-License-Identifier: GPL-3.0-or-later
"""The volume of a level set, and levels shifted so as to keep it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

FARTHEST = 40.0
"""Most that a level may be shifted so as to keep a volume."""


def filled_cells(level: np.ndarray) -> float:
    """Return the volume of liquid in cells; a cell that the surface cuts counts in part."""
    return float(np.clip(0.5 - level, 0.0, 1.0).sum(dtype=np.float64))


def shifted_to_volume(shifted: Callable[[float], np.ndarray], volume: float) -> np.ndarray:
    """Return the level ``shifted(more)`` for the number that gives it ``volume``, in cells.

    The greater the number, the less liquid. Returns ``shifted(0)`` if no number up to FARTHEST
    does, as for a level that hardly moves with it.
    """
    from scipy.optimize import brentq

    def surplus(more: float) -> float:
        return filled_cells(shifted(more)) - volume

    if surplus(-FARTHEST) <= 0 or surplus(FARTHEST) >= 0:
        return shifted(0.0)
    return shifted(brentq(surplus, -FARTHEST, FARTHEST, xtol=1e-3))
