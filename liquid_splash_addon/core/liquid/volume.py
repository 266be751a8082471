# SPDX-License-Identifier: GPL-3.0-or-later
"""How much liquid a level set holds, and how it keeps that."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

FARTHEST = 40.0
"""Most that a level may be shifted so as to keep a volume."""


def filled_cells(level: np.ndarray) -> float:
    """Return the volume in cells of those of ``level``; one the surface cuts counts in part."""
    return float(np.clip(0.5 - level, 0.0, 1.0).sum(dtype=np.float64))


def shifted_to_volume(shifted: Callable[[float], np.ndarray], volume: float) -> np.ndarray:
    """Return ``shifted(more)``, a level, for the number that gives it ``volume``, in cells.

    The greater the number, the less liquid. ``shifted(0)`` if none up to FARTHEST does: then it
    is hardly shifted by any.
    """
    from scipy.optimize import brentq

    def surplus(more: float) -> float:
        return filled_cells(shifted(more)) - volume

    if surplus(-FARTHEST) <= 0 or surplus(FARTHEST) >= 0:
        return shifted(0.0)
    return shifted(brentq(surplus, -FARTHEST, FARTHEST, xtol=1e-3))
