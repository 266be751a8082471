# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether shaders are to know of a mesh, and what strokes colour, read from the scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import bpy

from ...core.settings import SplashSettings
from ...core.sketch.drawing import Drawing
from ..data.look import colours_from_text, colours_to_text
from ..scene.liquid_materials import needs_attributes

if TYPE_CHECKING:
    from ...core.refinement.shader_attributes import Look


class WantedLook(NamedTuple):
    """What is wanted of a mesh.

    Attributes
    ----------
    attributes : whether shaders are to know of its vertices
    tints : whether strokes colour it
    """

    attributes: bool = False
    tints: bool = False


NOTHING = WantedLook()


def wanted_look(
    item: bpy.types.Object | None, settings: SplashSettings | None = None
) -> WantedLook:
    """Return what is wanted of a splash or model; of one yet to be made, by its settings."""
    if item is None:
        return WantedLook(settings is not None and settings.liquid != "WATER")
    group = item.splash_look
    tints = bool(group.stroke_colours)
    return WantedLook(group.attributes or tints or needs_attributes(item), tints)


def look_of(wanted: WantedLook, colours: str, strokes: int) -> Look | None:
    """Return what core is to make; None for nothing.

    colours : of ``strokes`` strokes as text, those of others, in a file that was put together by
    hand, do not count.
    """
    from ...core.refinement.shader_attributes import Look

    if not wanted.attributes:
        return None
    found = colours_from_text(colours) if wanted.tints and colours else None
    return Look(found if found is not None and len(found) == strokes else None)


def look_of_drawings(wanted: WantedLook, drawings: Sequence[Drawing]) -> Look | None:
    """Return what core is to make of drawings; None for nothing."""
    return look_of(wanted, text_of(drawings), len(drawings))


def text_of(drawings: Sequence[Drawing]) -> str:
    """Return the colours of drawings as text."""
    return colours_to_text([drawing.colour for drawing in drawings])
