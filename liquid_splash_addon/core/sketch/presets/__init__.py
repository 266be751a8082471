# SPDX-License-Identifier: GPL-3.0-or-later
"""Sketches that code draws as a hand would, each with a director's controls.

::

    pen      paths to strokes: the hand's speed, its asymmetry; what all presets share
    flows    what liquid does by itself: jet, sheet, wave
    ribbons  streams: streamlet, bottle pour, collision
    rings    what stands or hangs around an axis: crown, skirt
    figures  what artists make of it: heart, butterfly, letter S
"""

from __future__ import annotations

from collections.abc import Callable

from ..drawing import Drawing
from .figures import Butterfly, Heart, LetterS
from .flows import Jet, Sheet, Wave
from .pen import HAND_SPEED, SketchPreset, draw
from .ribbons import BottlePour, Collision, Streamlet
from .rings import Crown, Skirt

__all__ = ["HAND_SPEED", "PRESETS", "SKETCHES", "SketchPreset", "example_sketch"]

PRESETS: dict[str, type[SketchPreset]] = {
    "CROWN": Crown,
    "JET": Jet,
    "STREAMLET": Streamlet,
    "SHEET": Sheet,
    "WAVE": Wave,
    "SKIRT": Skirt,
    "HEART": Heart,
    "BUTTERFLY": Butterfly,
    "LETTER_S": LetterS,
    "BOTTLE_POUR": BottlePour,
    "COLLISION": Collision,
}
"""All preset sketches by identifier."""

MEASURED: dict[str, SketchPreset] = {
    "CROWN": Crown(),
    "JET": Jet(column=0.16, rim=0.0, jags=0.0, bow=0.0, strokes=9),
    "WAVE": Wave(jags=0.0, rounding=0.0, strokes=7),
}
"""The presets on which figures are measured, as they were when the first were."""


def example_sketch(name: str = "crown") -> list[Drawing]:
    """Return a preset at its defaults, without asymmetry, all of its layers in one list.

    Those of MEASURED are as they were. All is drawn at HAND_SPEED. ValueError names the presets
    there are.
    """
    preset = PRESETS.get(name.upper())
    if preset is None:
        known = ", ".join(identifier.lower() for identifier in PRESETS)
        raise ValueError(f"no sketch {name!r}: there are {known}")
    chosen = MEASURED.get(name.upper()) or preset()
    return [draw(path) for paths in chosen.paths().values() for path in paths]


def crown() -> list[Drawing]:
    """Return a crown: liquid thrown up and outwards from a ring, 2 units wide."""
    return example_sketch("crown")


def jet() -> list[Drawing]:
    """Return a jet that comes down and spreads over a point, 2 units wide."""
    return example_sketch("jet")


def wave() -> list[Drawing]:
    """Return a sheet that curls over like a breaking wave, 2 units long."""
    return example_sketch("wave")


SKETCHES: dict[str, Callable[[], list[Drawing]]] = {"crown": crown, "jet": jet, "wave": wave}
"""The sketches on which figures are measured, by name: they are kept as they are."""
