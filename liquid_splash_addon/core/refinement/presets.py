# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets: named lists of refinements."""

from __future__ import annotations

from typing import NamedTuple

from .settings import (
    CleanupSettings,
    DropletSettings,
    RefinementSettings,
    RuptureSettings,
    SheetSettings,
    WaveSettings,
)


class Preset(NamedTuple):
    """A list of refinements, with what an interface shows of it."""

    label: str
    about: str
    steps: tuple[RefinementSettings, ...]


PRESETS: dict[str, Preset] = {
    "FRESH": Preset(
        "Fresh Water",
        "Thin films with rims, some drops and fine waves",
        (DropletSettings(), SheetSettings(), WaveSettings()),
    ),
    "MILK": Preset(
        "Milk",
        "Few, large, round drops and long soft waves",
        (
            DropletSettings(amount=0.001, size=2.0, spread=0.25, cohesion=0.9),
            WaveSettings(amplitude=0.001, frequency=5.0, speed=0.15),
        ),
    ),
    "STORM": Preset(
        "Storm",
        "Torn fronts and much spray",
        (
            RuptureSettings(amount=0.06),
            DropletSettings(amount=0.006, size=1.0, spread=0.6, cohesion=0.3),
            CleanupSettings(volume=12.0),
            WaveSettings(),
        ),
    ),
    "FINGERS": Preset(
        "Fingers",
        "Fronts that have broken into fingers with a drop here and there",
        (
            RuptureSettings(amount=0.03, size=2.0, depth=0.033),
            DropletSettings(amount=0.001),
            CleanupSettings(),
        ),
    ),
}
"""All presets by identifier."""

BARE = "BARE"
"""Identifies the choice of no refinements at all: what the generator answers."""

STARTS: dict[str, Preset] = {
    **PRESETS,
    BARE: Preset("Bare Liquid", "No refinements: the liquid as the generator makes it", ()),
}
"""Lists that new splashes can start with by identifier; the first one unless another is chosen."""
