# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects whose strokes make a splash: one, or several read as one sketch."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import bpy
import numpy as np

from ...core.sketch.drawing import Drawing
from . import curves, grease_pencil, places


def read_sketch(
    objects: Sequence[bpy.types.Object],
    layer: str = "",
    modifiers: bool = False,
    to_space: np.ndarray | None = None,
) -> tuple[list[Drawing], list[str]]:
    """Read the strokes of all objects in the drawing space of the first, and warnings.

    So what a splash is made of changes when one of the others is moved against the first.

    layer : the one layer to read of a Grease Pencil object; empty for all visible layers
    modifiers : whether strokes are read as the objects' modifiers leave them
    to_space : from the world to another space, float64 ``(4, 4)``
    """
    if to_space is None:
        to_space = places.to_drawing_space(objects[0])
    drawings: list[Drawing] = []
    warnings: list[str] = []
    for item in objects:
        found, said = read_object(item, layer, to_space, modifiers)
        drawings += found
        warnings += said if len(objects) == 1 else [f"'{item.name}': {line}" for line in said]
    return drawings, warnings


def read_object(
    item: bpy.types.Object,
    layer: str = "",
    to_space: np.ndarray | None = None,
    modifiers: bool = False,
) -> tuple[list[Drawing], list[str]]:
    """Read the strokes of one object, by default in its own drawing space, and warnings."""
    if modifiers and item.modifiers and not places.is_evaluated(item):
        with places.evaluated_copy(item) as shown:
            return read_as(item, layer, to_space, shown)
    shown = None
    if modifiers and item.modifiers:
        shown = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    drawings, warnings = read_as(item, layer, to_space, shown)
    if not modifiers and (names := [m.name for m in item.modifiers if m.show_viewport]):
        warnings.append(f"Modifiers do not count ({', '.join(names)}): switch on Modifiers")
    return drawings, warnings


def read_as(
    item: bpy.types.Object,
    layer: str,
    to_space: np.ndarray | None,
    evaluated: bpy.types.Object | None,
) -> tuple[list[Drawing], list[str]]:
    """Read the strokes of an object as its modifiers leave them, if ``evaluated`` is given."""
    if item.type == "GREASEPENCIL":
        return grease_pencil.read_drawings(item, layer, to_space, evaluated)
    return curves.read_drawings(item, to_space, evaluated)


def select_strokes(item: bpy.types.Object, layer: str, numbers: Collection[int]) -> None:
    """Select strokes alone, by their places in what :func:`read_object` reads."""
    if item.type == "GREASEPENCIL":
        grease_pencil.select_strokes(item, layer, numbers)
    else:
        curves.select_strokes(item, numbers)
