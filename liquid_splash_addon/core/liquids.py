# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquids to choose from, and what their viscosity and surface tension do against water's.

Everything here is relative to water, whose figures the rest of core has: for water all factors are
exactly 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, sqrt


@dataclass(frozen=True)
class Liquid:
    """A liquid at 20 degrees Celsius (chocolate at 40), at the shear of a splash.

    Attributes
    ----------
    label, about : for an interface
    tension : surface tension, N/m
    density : kg/m^3
    viscosity : dynamic, Pa s
    """

    label: str
    about: str
    tension: float
    density: float
    viscosity: float

    @property
    def pull(self) -> float:
        """Surface tension over density, m^3/s^2."""
        return self.tension / self.density

    def ohnesorge(self, radius: float) -> float:
        """Return Oh = mu / sqrt(rho sigma a): viscosity against inertia and surface tension.

        radius : a of a thread, m.
        """
        return self.viscosity / sqrt(self.density * self.tension * radius)


LIQUIDS: dict[str, Liquid] = {
    "WATER": Liquid("Water", "Films, beads and many drops", 0.0728, 998.0, 0.0010),
    "WINE": Liquid("Wine", "As thin as water, with less surface tension", 0.048, 992.0, 0.0016),
    "INK": Liquid("Ink", "A little thicker than water", 0.045, 1040.0, 0.0030),
    "MILK": Liquid("Milk", "Skirts with soft rims", 0.047, 1030.0, 0.0020),
    "JUICE": Liquid("Juice", "Cloudy and a little thicker than water", 0.055, 1045.0, 0.0050),
    "PAINT": Liquid("Paint", "Ribbons; few drops come off", 0.035, 1250.0, 0.8),
    "CHOCOLATE": Liquid("Chocolate", "Folds and strands without drops", 0.045, 1270.0, 3.0),
    "HONEY": Liquid("Honey", "Smooth ropes and sheets that do not break", 0.055, 1420.0, 10.0),
}
"""All liquids by identifier, from thin to thick: typical values of the trade's handbooks."""

WATER = LIQUIDS["WATER"]

ITEMS = tuple((name, liquid.label, liquid.about) for name, liquid in LIQUIDS.items())
"""Identifier, label and description of each, for a setting."""


def slowing(liquid: Liquid, radius: float) -> float:
    """Return by what factor viscosity slows down the breakup of a thread of ``radius`` a, m.

    Of long waves on a thread the fastest grows at sqrt(sigma / (rho a^3)) / (sqrt(8) + 6 Oh)
    (Weber 1931; Eggers and Villermaux 2008, 3.2), that is, 1 + 3 Oh / sqrt(2) times as slowly as
    without viscosity. Its wavelength is the root of that factor longer.
    """

    def slowed(oh: float) -> float:
        return 1 + 3 * oh / sqrt(2)

    return slowed(liquid.ohnesorge(radius)) / slowed(WATER.ohnesorge(radius))


def swept(liquid: Liquid, film: float, seconds: float) -> float:
    """Return how far a film's edge is drawn in, over the Taylor-Culick speed times the time.

    A tension of 2 sigma thickens a film of thickness h at the rate sigma / (2 mu h) (its Trouton
    viscosity is 4 mu), so the edge reaches its speed within tau = 2 mu h / sigma:
    1 - (1 - exp(-t / tau)) tau / t. Viscosity beyond water's counts.

    film : thickness, m; seconds : of flight.
    """
    tau = 2 * (liquid.viscosity - WATER.viscosity) * film / liquid.tension
    if tau <= 0:
        return 1.0
    return 1 - (1 - exp(-seconds / tau)) * tau / seconds
