# SPDX-License-Identifier: GPL-3.0-or-later
"""The strokes of a sketch that a tool means, in the world: what is selected, else a layer."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import bpy
import numpy as np

from ...core.sketch.drawing import Drawing, fault_of
from ...core.sketch.flow import Flow
from .grease_pencil import (
    drawn_strokes,
    has_strokes,
    is_hidden,
    is_in_locked_group,
    layer_matrix,
)
from .objects import SceneError
from .raw_strokes import BEZIER, NURBS, RawStroke, read_attribute, to_drawing
from .world_strokes import can_be_drawn_on

SELECTION = ".selection"
"""Attribute in which Blender keeps what is selected; where it is absent, all is."""


class ChosenStroke(NamedTuple):
    """A stroke that a tool means.

    Attributes
    ----------
    layer : name of its layer; number : its place in the layer's drawing
    drawing : in the world; pressures are radii in the layer's own space
    points : how many the layer's drawing has of it; of a spline the drawing has more
    flow : what the artist says of its speed; the drawing is as it was drawn
    """

    layer: str
    number: int
    drawing: Drawing
    points: int
    flow: Flow


def chosen_strokes(sketch: bpy.types.Object) -> tuple[list[ChosenStroke], list[str]]:
    """Return the strokes that a tool means, and what to say of those that were left out.

    Selected strokes of all layers, if some are selected and others are not or if one sees in Edit
    Mode what is selected; else those of the active layer. Raises SceneError, with advice, where
    there is nothing to work on.
    """
    check_can_be_changed(sketch)
    selected = list(selected_strokes(sketch))
    said = []
    if any(is_editable(layer) for layer, _ in selected):
        kept_out = sum(len(numbers) for layer, numbers in selected if not is_editable(layer))
        if kept_out:
            said.append(f"Left out {kept_out} selected stroke(s) in locked or hidden layers")
        pairs = [(layer, numbers) for layer, numbers in selected if is_editable(layer)]
    elif selected:
        raise SceneError(f"{sentence_about(selected[0][0])}: the selected strokes are in it")
    else:
        layer = active_layer(sketch)
        pairs = [(layer, range(len(layer.current_frame().drawing.strokes)))]
    found = [stroke for layer, numbers in pairs for stroke in read(sketch, layer, numbers)]
    usable = [stroke for stroke in found if not fault_of(stroke.drawing)]
    if not usable:
        raise SceneError("None of these strokes has a length: draw a longer one first")
    if len(usable) < len(found):
        said.append(f"Left out {len(found) - len(usable)} stroke(s) without length")
    return usable, said


def check_can_be_changed(sketch: bpy.types.Object) -> None:
    """Raise SceneError where nobody can draw on an object."""
    if sketch.type != "GREASEPENCIL":
        raise SceneError("Select a Grease Pencil sketch first: curves have tools of their own")
    if not can_be_drawn_on(sketch):
        raise SceneError(f"'{sketch.name}' is linked from another file: make it local first")


def selected_strokes(sketch: bpy.types.Object) -> Iterator[tuple[Any, list[int]]]:
    """Yield the layers that have selected strokes at the current frame, and which these are.

    A stroke is selected if one of its points is. Outside Edit Mode nothing shows what is, so that
    layers of which all is selected, as new ones are, say nothing.
    """
    is_seen = sketch.mode == "EDIT"
    layers = [layer for layer in sketch.data.layers if has_strokes(layer)]
    flags = [flags_of(layer.current_frame().drawing) for layer in layers]
    if not is_seen and all(selected.all() for selected in flags):
        return
    for layer, selected in zip(layers, flags, strict=True):
        if selected.any():
            yield layer, np.flatnonzero(selected).tolist()


def flags_of(drawing: Any) -> np.ndarray:
    """Return which strokes of a layer's drawing are selected, bool ``(n,)``."""
    bounds = bounds_of(drawing)
    values = read_attribute(drawing, SELECTION)
    if values is None:
        return np.ones(len(bounds) - 1, dtype=bool)
    if drawing.attributes[SELECTION].domain == "CURVE":
        return values > 0
    return np.array([values[first:last].any() for first, last in pairwise(bounds)])


def bounds_of(drawing: Any) -> np.ndarray:
    """Return where each stroke of a layer's drawing begins, and the end, int ``(n + 1,)``."""
    bounds = np.zeros(len(drawing.curve_offsets), dtype=np.int32)
    drawing.curve_offsets.foreach_get("value", bounds)
    return bounds


def is_editable(layer: Any) -> bool:
    """Whether strokes of a layer may be changed."""
    return not (is_locked(layer) or is_hidden(layer))


def is_locked(layer: Any) -> bool:
    """Whether a layer, or a group that holds it, is locked."""
    return layer.lock or is_in_locked_group(layer)


def sentence_about(layer: Any) -> str:
    """Say why a layer cannot be changed, and what to do."""
    how, remedy = ("hidden", "show") if is_hidden(layer) else ("locked", "unlock")
    return f"Layer '{layer.name}' is {how}, {remedy} it first"


def active_layer(sketch: bpy.types.Object) -> Any:
    """Return the active layer. Raises SceneError if it has no strokes to be changed."""
    layer = sketch.data.layers.active
    if layer is None or not has_strokes(layer):
        name = "" if layer is None else f" on layer '{layer.name}'"
        raise SceneError(f"Draw a stroke first{name}: there is none at this frame")
    if not is_editable(layer):
        raise SceneError(sentence_about(layer))
    return layer


def read(sketch: bpy.types.Object, layer: Any, numbers: Any) -> Iterator[ChosenStroke]:
    """Yield strokes of a layer, in the world. Splines are read as polylines."""
    matrix = layer_matrix(sketch, layer)
    strokes = list(drawn_strokes(layer))
    for number in numbers:
        stroke = strokes[number]
        drawing = open_drawing(stroke, matrix)
        flow = stroke.flow or Flow()
        yield ChosenStroke(layer.name, number, drawing, len(stroke.points), flow)


def open_drawing(stroke: RawStroke, matrix: np.ndarray) -> Drawing:
    """Return a stroke, moved by ``matrix`` ``(4, 4)``; of a closed one without its return."""
    if stroke.curve_type not in (BEZIER, NURBS):
        return to_drawing(stroke._replace(is_cyclic=False), matrix)
    drawing = to_drawing(stroke, matrix)
    if not stroke.is_cyclic or len(stroke.points) < 3:
        return drawing
    return Drawing(
        drawing.points[:-1],
        *(
            None if column is None else column[:-1]
            for column in (drawing.times, drawing.pressures, drawing.speeds)
        ),
    )
