# SPDX-License-Identifier: GPL-3.0-or-later
"""The colours in which the strokes of a Grease Pencil layer are drawn."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from .raw_strokes import read_attribute
from .sketch import INK

Colour = tuple[float, float, float]


def stroke_colours(owner: bpy.types.Object, layer: Any) -> list[Colour | None]:
    """Return the linear colour of each stroke of a layer at the current frame.

    It is that of its material, over which the layer's tint goes as far as its factor. None for
    strokes in the ink of new sketches, which says nothing, unless their layer has a tint.
    """
    drawing = layer.current_frame().drawing
    count = len(drawing.curve_offsets) - 1
    numbers = read_attribute(drawing, "material_index")
    used = np.zeros(count, dtype=int) if numbers is None else numbers.astype(int)
    slots = [colour_of(slot.material) for slot in owner.material_slots]
    factor, tint = float(layer.tint_factor), tuple(map(float, layer.tint_color))
    return [
        tinted(slots[number] if 0 <= number < len(slots) else None, tint, factor)
        for number in used.tolist()
    ]


def colour_of(material: bpy.types.Material | None) -> Colour | None:
    """Return the colour of the lines of a Grease Pencil material; None of ink and of others."""
    style = None if material is None else material.grease_pencil
    if material is None or style is None or material.name.startswith(INK):
        return None
    red, green, blue, _ = style.color
    return red, green, blue


def tinted(colour: Colour | None, tint: tuple[float, ...], factor: float) -> Colour | None:
    """Return a colour with a layer's tint over it."""
    if factor == 0:
        return colour
    red, green, blue = tint[:3]
    if colour is None:
        return red, green, blue
    mixed = [(1 - factor) * a + factor * b for a, b in zip(colour, (red, green, blue), strict=True)]
    return mixed[0], mixed[1], mixed[2]
