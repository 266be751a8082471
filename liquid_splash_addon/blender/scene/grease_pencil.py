# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes of a Grease Pencil object as core's Drawings, in drawing space (see raw_strokes.py)."""

from __future__ import annotations

from collections.abc import Collection
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
    raw_strokes,
    to_drawing,
)


def read_drawings(
    sketch: bpy.types.Object,
    only: str = "",
    to_space: np.ndarray | None = None,
    evaluated: bpy.types.Object | None = None,
) -> tuple[list[Drawing], list[str]]:
    """Read the sketch's strokes at the current frame, in drawing space; return them and warnings.

    Layers without a drawing at this frame are left out, and so are hidden layers, with a warning.
    The sketch's modifiers are not applied: they would separate the points from their times.

    only : the name of the one layer to read, hidden or not; empty for all visible layers.
    to_space : world to drawing space, float64 ``(4, 4)``; by default the sketch's own.
    evaluated : the sketch with its modifiers applied, to be read instead
    """
    drawings, warnings, skipped = [], [], 0
    if to_space is None:
        to_space = np.array(places.rigid_matrix(sketch).inverted(), dtype=np.float64)
    for layer in (evaluated or sketch).data.layers:
        if not has_strokes(layer) or (only and layer.name != only):
            continue
        if is_hidden(layer) and not only:
            skipped += 1
            continue
        matrix = to_space @ layer_matrix(sketch, layer)
        for stroke in drawn_strokes(layer):
            drawings.append(to_drawing(stroke, matrix))
    if skipped:
        warnings.append(f"Left out {skipped} hidden layer(s): show them to include them")
    return drawings_with_pressure(drawings), warnings


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
        is_read = has_strokes(layer) and (layer.name == only if only else not is_hidden(layer))
        for stroke in frame.drawing.strokes:
            stroke.select = is_read and at in numbers
            at += is_read


def drawn_layers(sketch: bpy.types.Object) -> list[str]:
    """List the names of the visible layers that have strokes at the current frame."""
    return [
        layer.name for layer in sketch.data.layers if has_strokes(layer) and not is_hidden(layer)
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
