# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines of text in a viewport, for what is drawn into it."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

FONT = 0
"""Blender's own."""

WHITE = (1.0, 1.0, 1.0, 1.0)


def width_of(text: str, size: float) -> float:
    """Return the width of a line, in pixels.

    size : height of the letters in pixels
    """
    import blf

    blf.size(FONT, size)
    return float(blf.dimensions(FONT, text)[0])


def write(
    text: str, place: tuple[float, float], size: float, colour: Sequence[float] = WHITE
) -> None:
    """Draw a line with a shadow, so that it can be read on anything.

    place : of its lower left corner in the viewport, in pixels; size : height of the letters
    """
    import blf

    blf.size(FONT, size)
    blf.enable(FONT, blf.SHADOW)
    blf.shadow(FONT, 5, 0.0, 0.0, 0.0, 1.0)
    blf.color(FONT, *colour)
    blf.position(FONT, *place, 0)
    blf.draw(FONT, text)
    blf.disable(FONT, blf.SHADOW)


def lower_edge(context: bpy.types.Context) -> float:
    """Return how much of a viewport the asset shelf covers from below, in pixels."""
    region = context.region
    shelves = [item for item in context.area.regions if item.type.startswith("ASSET_SHELF")]
    tops = [shelf.y + shelf.height - region.y for shelf in shelves if shelf.height > 1]
    below_middle = [top for top in tops if top < region.height / 2]
    return float(max(below_middle, default=0))
