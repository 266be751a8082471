# SPDX-License-Identifier: GPL-3.0-or-later
"""Where strokes lie in one list that tools can change: a layer of Grease Pencil, or curves.

Blender names the same things differently for both; here they have Grease Pencil's names.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import bpy
import numpy as np

from .grease_pencil import has_strokes, is_hidden, is_in_locked_group, layer_matrix
from .objects import SceneError

TYPES = ("GREASEPENCIL", "CURVES")
"""Types of objects whose strokes tools change."""


class Sheet(NamedTuple):
    """Strokes in one list.

    Attributes
    ----------
    name : of the layer; "" of curves
    drawing : has the attributes
    matrix : of the points to the world, float64 ``(4, 4)``
    fault : why nothing may be changed, and what to do; "" where it may
    """

    name: str
    drawing: Any
    matrix: np.ndarray
    fault: str = ""


class CurvesDrawing:
    """The curves of an object, as a drawing of Grease Pencil is handled."""

    def __init__(self, curves: Any) -> None:
        self.curves = curves

    @property
    def attributes(self) -> Any:
        """All attributes."""
        return self.curves.attributes

    @property
    def curve_offsets(self) -> Any:
        """Where each curve begins, and the end."""
        return self.curves.curve_offset_data

    def add_strokes(self, sizes: Sequence[int]) -> None:
        """Append curves of so many points."""
        self.curves.add_curves(sizes)

    def reorder_strokes(self, new_indices: Sequence[int]) -> None:
        """Put curves into another order: what is to come first, second and so on."""
        self.curves.reorder_curves(new_indices=new_indices)

    def remove_strokes(self, indices: Sequence[int]) -> None:
        """Remove curves."""
        self.curves.remove_curves(indices=indices)

    def tag_positions_changed(self) -> None:
        """Have Blender draw them anew."""
        self.curves.update_tag()


def sheets_of(item: bpy.types.Object) -> list[Sheet]:
    """Return the lists of an object that have strokes at the current frame.

    Raises SceneError where nobody can change them.
    """
    check_can_be_changed(item)
    if item.type == "CURVES":
        matrix = np.array(item.matrix_world, dtype=np.float64)
        return [Sheet("", CurvesDrawing(item.data), matrix)] if len(item.data.curves) else []
    return [sheet_of(item, layer) for layer in item.data.layers if has_strokes(layer)]


def sheet_of(sketch: bpy.types.Object, layer: Any) -> Sheet:
    """Return a layer's strokes at the current frame."""
    drawing, matrix = layer.current_frame().drawing, layer_matrix(sketch, layer)
    return Sheet(layer.name, drawing, matrix, fault_of_layer(layer))


def active_sheet(item: bpy.types.Object) -> Sheet:
    """Return the curves, or the active layer. Raises SceneError if there is nothing to change."""
    if item.type == "CURVES":
        sheets = sheets_of(item)
        if not sheets:
            raise SceneError("Draw a curve first: there is none in this object")
        return sheets[0]
    layer = item.data.layers.active
    if layer is None or not has_strokes(layer):
        name = "" if layer is None else f" on layer '{layer.name}'"
        raise SceneError(f"Draw a stroke first{name}: there is none at this frame")
    sheet = sheet_of(item, layer)
    if sheet.fault:
        raise SceneError(sheet.fault)
    return sheet


def check_can_be_changed(item: bpy.types.Object) -> None:
    """Raise SceneError where nobody can change strokes."""
    if item.type == "CURVE":
        raise SceneError(
            "Tools on strokes need another type of curves: Object > Convert > Curves first"
        )
    if item.type not in TYPES:
        raise SceneError("Select a Grease Pencil sketch or curves first")
    if not (item.is_editable and item.data.is_editable):
        raise SceneError(f"'{item.name}' is linked from another file: make it local first")


def fault_of_layer(layer: Any) -> str:
    """Say why a layer cannot be changed, and what to do; "" where it can."""
    if is_hidden(layer):
        return f"Layer '{layer.name}' is hidden, show it first"
    if layer.lock or is_in_locked_group(layer):
        return f"Layer '{layer.name}' is locked, unlock it first"
    return ""
