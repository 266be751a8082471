# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of refinements as they are for another liquid than water: the same sliders, scaled.

Where water parts into drops, a viscous liquid keeps strands, and waves die away. Formulas are in
core.liquids; radii and times are the usual ones of a splash.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from math import exp, pi, sqrt
from typing import Any

from ..grid import LOCAL_SPACING
from ..liquids import LIQUIDS, WATER, Liquid, slowing, swept
from .settings import (
    DropletSettings,
    RefinementSettings,
    RuptureSettings,
    SheetSettings,
    WaveSettings,
)

FLIGHT = 0.05
"""Seconds for which a sheet has flown: of a splash of 10 cm at 2 m/s."""

LEAST_FILM, LEAST_RIM = 1e-4, 3e-4
"""Thickness of a film and radius of a rim, metres, below which neither is taken to be."""

KEPT_DROP = 1.35
"""Length of a finger, in units of the slider, that the liquid of the drops makes which it would
shed at Drops 1: two drops of 1.4 radii are 6.8 radii of finger."""

DAMPING_TIME = 1 / 60
"""Seconds after which the damping of waves has acted once."""


def for_liquid(steps: Sequence[RefinementSettings], name: str) -> list[RefinementSettings]:
    """Return ``steps`` as they are for the liquid ``name`` (of LIQUIDS); water's unchanged."""
    if name == "WATER":
        return list(steps)
    liquid = LIQUIDS[name]
    return [
        limited(step, SCALED[type(step)](step, liquid)) if type(step) in SCALED else step
        for step in steps
    ]


def limited(step: RefinementSettings, factors: dict[str, float]) -> RefinementSettings:
    """Return settings with new values, kept within their limits."""
    limits = {item.name: item.metadata for item in fields(step)}
    kept = {
        name: min(max(value, limits[name]["low"]), limits[name]["high"])
        for name, value in factors.items()
    }
    return replace(step, **kept)


def droplets(step: DropletSettings, liquid: Liquid) -> dict[str, float]:
    """Fewer drops leave in the same time, and from a longer stretch of thread each.

    A drop has the volume of a wavelength of thread, so its radius goes with the third root of that.
    """
    slower = slowing(liquid, step.size * LOCAL_SPACING)
    return {
        "amount": step.amount * sqrt(liquid.pull / WATER.pull) / slower,
        "size": step.size * slower ** (1 / 6),
    }


def ruptures(step: RuptureSettings, liquid: Liquid) -> dict[str, float]:
    """Air opens a front at the rate at which threads break."""
    slower = slowing(liquid, step.size * LOCAL_SPACING)
    return {"amount": step.amount * sqrt(liquid.pull / WATER.pull) / slower}


def sheets(step: SheetSettings, liquid: Liquid) -> dict[str, float]:
    """Rims gather more slowly and bead less, farther apart; what is not shed stays in the finger.

    A rim's radius is sqrt(h u t / pi), u the Taylor-Culick speed sqrt(2 sigma / (rho h)).
    """
    film = max(step.film / 1000, LEAST_FILM)
    share = swept(liquid, film, FLIGHT)
    rims = step.rims * (liquid.pull / WATER.pull) ** 0.25 * sqrt(share)
    speed = sqrt(2 * WATER.pull / film)
    radius = max(rims * sqrt(film * speed * FLIGHT / pi), LEAST_RIM)
    slower = slowing(liquid, radius)
    kept = KEPT_DROP * step.drops * (1 - 1 / slower) if step.fingers > 0 else 0.0
    return {
        "rims": rims,
        "beads": step.beads / slower,
        "spacing": step.spacing * sqrt(slower),
        "fingers": step.fingers + kept,
        "drops": step.drops / slower,
        "holes": step.holes * share,
    }


def waves(step: WaveSettings, liquid: Liquid) -> dict[str, float]:
    """Waves of the same length run at sqrt(sigma k / rho) and die away as exp(-2 nu k^2 t).

    (Lamb 1932, 266 and 348.) A source of frequency f drives them to 1 / (1 + 2 nu k^2 / (2 pi f))
    of their height. Viscosity beyond water's counts.
    """
    k = 2 * pi / step.wavelength
    faster = sqrt(liquid.pull / WATER.pull)
    kinematic = liquid.viscosity / liquid.density - WATER.viscosity / WATER.density
    decay = 2 * max(kinematic, 0.0) * k**2
    return {
        "speed": step.speed * faster,
        "frequency": step.frequency * faster,
        "damping": step.damping * exp(-decay * DAMPING_TIME),
        "amplitude": step.amplitude / (1 + decay / (2 * pi * step.frequency)),
    }


SCALED: dict[type[RefinementSettings], Callable[[Any, Liquid], dict[str, float]]] = {
    DropletSettings: droplets,
    RuptureSettings: ruptures,
    SheetSettings: sheets,
    WaveSettings: waves,
}
"""What each kind's sliders become; others stay as they are."""
