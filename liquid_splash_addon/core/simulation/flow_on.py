# SPDX-License-Identifier: GPL-3.0-or-later
"""Flow On: the splash a few milliseconds later."""

from __future__ import annotations

from ..liquid.level_set import LevelSet
from ..progress import Report, silent
from .start import Start

MOST_MILLISECONDS = 100.0
"""Longest time that a splash is flown on."""


def flow_on(
    start: Start, milliseconds: float, report: Report = silent, gravity: float = 9.81
) -> LevelSet:
    """Return the splash ``milliseconds`` (0 to MOST_MILLISECONDS) of its own time later.

    The result is on the same grid as ``start.liquid``, level in cells and velocity in m/s: what
    leaves the grid is cut off. 0 returns the liquid itself. Free drops are flown on with it and
    are part of it afterwards. ``start.frame_seconds`` and ``ground`` are of no account.

    gravity : m/s^2, against ``start.up``; 0 for none. report : called with the share done; may
    raise Cancelled. Raises ValueError, with a sentence for the user, where there is no liquid.
    """
    raise NotImplementedError
