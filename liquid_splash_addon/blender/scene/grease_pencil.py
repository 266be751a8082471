# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes of a Grease Pencil object as core's Drawings, in drawing space (see raw_strokes.py)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import replace
from itertools import pairwise
from typing import Any

import bpy
import numpy as np

from ...core.sketch.drawing import Drawing
from . import places
from .raw_strokes import (
    CATMULL_ROM,
    POLY,
    RawStroke,
    drawings_with_pressure,
    flowing,
    raw_strokes,
    read_attribute,
    to_drawing,
)
from .stroke_colours import stroke_colours


def read_drawings(
    sketch: bpy.types.Object,
    only: str = "",
    to_space: np.ndarray | None = None,
    evaluated: bpy.types.Object | None = None,
) -> tuple[list[Drawing], list[str]]:
    """Read the sketch's strokes at the current frame, in drawing space; return them and warnings.

    Layers without a drawing at this frame are left out. So is, with a warning, what nobody sees or
    is to touch: hidden and locked layers, hidden materials, opacity 0, fills.

    only : the name of the one layer to read, hidden or not; empty for all visible layers.
    to_space : world to drawing space, float64 ``(4, 4)``; by default the sketch's own.
    evaluated : the sketch with its modifiers applied, to be read instead
    """
    if to_space is None:
        to_space = places.to_drawing_space(sketch)
    owner, drawings = evaluated or sketch, []
    left_out: Counter[str] = Counter()
    masked = []
    keyed = {layer.name: layer for layer in places.data_now(owner).layers}
    for layer in owner.data.layers:
        if not has_strokes(layer) or (only and layer.name != only):
            continue
        now = keyed.get(layer.name, layer)
        if not only and (reason := reason_against(now)):
            left_out[reason] += 1
            continue
        if layer.use_masks and any(not mask.hide for mask in layer.mask_layers):
            masked.append(layer.name)
        matrix = to_space @ layer_matrix(sketch, now)
        strokes, colours = drawn_strokes(layer), stroke_colours(owner, layer)
        for stroke, fault, colour in zip(strokes, faults_of(owner, layer), colours, strict=True):
            if fault:
                left_out[fault] += 1
            else:
                drawing = flowing(stroke, to_drawing(stroke, matrix))
                drawings.append(replace(drawing, colour=colour))
    warnings = [LEFT_OUT[reason].format(count) for reason, count in left_out.items()]
    warnings += [f"Layer '{name}' is masked, but its strokes count whole" for name in masked]
    return drawings_with_pressure(drawings), warnings


HIDDEN, LOCKED, FADED, UNSEEN, FILL, CLEAR = range(1, 7)
LEFT_OUT = {
    HIDDEN: "Left out {} hidden layer(s): show them to include them",
    LOCKED: "Left out {} locked layer(s): unlock them to include them",
    FADED: "Left out {} layer(s) of opacity 0: raise it to include them",
    UNSEEN: "Left out {} stroke(s) of a hidden material: show it to include them",
    FILL: "Left out {} fill(s): give their material a stroke to include them",
    CLEAR: "Left out {} stroke(s) of opacity 0: raise it to include them",
}
"""What is said of layers and strokes that do not count, by the reason."""


def reason_against(layer: Any) -> int | None:
    """Return why a layer does not count where all visible ones do; None if it does."""
    if is_hidden(layer):
        return HIDDEN
    if layer.lock or is_in_locked_group(layer):
        return LOCKED
    return FADED if layer.opacity == 0 else None


def is_in_locked_group(layer: Any) -> bool:
    """Whether a group that holds a layer is locked."""
    group = layer.parent_group
    return group is not None and (group.lock or is_in_locked_group(group))


def faults_of(owner: bpy.types.Object, layer: Any) -> list[int | None]:
    """Return of each stroke of a layer why it does not count, None if it does."""
    drawing = layer.current_frame().drawing
    bounds = np.empty(len(drawing.curve_offsets), dtype=np.int32)
    drawing.curve_offsets.foreach_get("value", bounds)
    numbers = read_attribute(drawing, "material_index")
    opacities = read_attribute(drawing, "opacity")
    unseen = read_attribute(drawing, "hide_stroke")
    slots = [fault_of_material(slot.material) for slot in owner.material_slots]
    found: list[int | None] = []
    for stroke, (first, last) in enumerate(pairwise(bounds.tolist())):
        number = 0 if numbers is None else int(numbers[stroke])
        fault = slots[number] if 0 <= number < len(slots) else None
        if fault is None and unseen is not None and unseen[stroke]:
            fault = FILL
        if fault is None and opacities is not None and not opacities[first:last].any():
            fault = CLEAR
        found.append(fault)
    return found


def fault_of_material(material: bpy.types.Material | None) -> int | None:
    """Return why strokes of a material do not count; None if they do."""
    style = None if material is None else material.grease_pencil
    if style is None:
        return None
    if style.hide:
        return UNSEEN
    # Later versions ask the strokes themselves, and the flag says nothing any more.
    return FILL if bpy.app.version < (5, 1, 0) and not style.show_stroke else None


def drawn_strokes(layer: Any) -> list[RawStroke]:
    """Return a layer's strokes at the current frame.

    A pen leaves points so close together that splines through them would be of no use.
    """
    drawing = layer.current_frame().drawing
    return [
        stroke._replace(curve_type=POLY) if stroke.curve_type == CATMULL_ROM else stroke
        for stroke in raw_strokes(drawing, drawing.curve_offsets)
    ]


def select_strokes(sketch: bpy.types.Object, only: str, numbers: Collection[int]) -> None:
    """Select strokes alone, by their places in what :func:`read_drawings` reads.

    only : as there
    """
    at = 0
    for layer in sketch.data.layers:
        frame = layer.current_frame()
        if frame is None:
            continue
        counts = has_strokes(layer) and (
            layer.name == only if only else reason_against(layer) is None
        )
        faults = faults_of(sketch, layer) if counts else [HIDDEN] * len(frame.drawing.strokes)
        for stroke, fault in zip(frame.drawing.strokes, faults, strict=True):
            stroke.select = fault is None and at in numbers
            at += fault is None


def drawn_layers(sketch: bpy.types.Object) -> list[str]:
    """List the names of the layers that count and have strokes at the current frame."""
    return [
        layer.name
        for layer in sketch.data.layers
        if has_strokes(layer) and reason_against(layer) is None
    ]


def has_strokes(layer: Any) -> bool:
    """Whether a layer has strokes at the current frame."""
    frame = layer.current_frame()
    return frame is not None and len(frame.drawing.curve_offsets) > 1


def is_hidden(layer: Any) -> bool:
    """Whether a layer, or a group that holds it, is hidden."""
    return layer.hide or (layer.parent_group is not None and is_hidden(layer.parent_group))


def layer_matrix(sketch: bpy.types.Object, layer: Any) -> np.ndarray:
    """Return the transform of a layer's points to the world, float64 ``(4, 4)``."""
    local = np.array(layer.matrix_local, dtype=np.float64)
    parent = layer.parent
    if parent is None:
        return np.array(places.world_matrix(sketch), dtype=np.float64) @ local
    bone = places.bone_matrix(parent, layer.parent_bone) if layer.parent_bone else None
    world = np.array(places.world_matrix(parent) if bone is None else bone, dtype=np.float64)
    return world @ np.array(layer.matrix_parent_inverse, dtype=np.float64) @ local
