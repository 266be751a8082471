# SPDX-License-Identifier: GPL-3.0-or-later
"""Breakup of other liquids than water."""

from __future__ import annotations

from dataclasses import replace

from ..grid import LOCAL_SPACING
from ..liquids import LIQUIDS, WATER, slowing
from ..settings import SplashSettings


def for_breakup(settings: SplashSettings, cell: float = LOCAL_SPACING) -> SplashSettings:
    """Return settings whose Breakup is that of the liquid: for water, what they are.

    Disturbances grow at the root of Breakup, so it is divided by the square of what viscosity
    slows that down, for threads as thick as a cell, metres.
    """
    if settings.liquid == "WATER":
        return settings
    liquid = LIQUIDS[settings.liquid]
    tension = liquid.pull / WATER.pull
    slower = slowing(liquid, cell)
    return replace(settings, breakup=settings.breakup * tension / slower**2)
