# SPDX-License-Identifier: GPL-3.0-or-later
"""The strokes of a sketch that a tool means, in the world: what is selected, else a layer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import bpy
import numpy as np

from ...core.sketch.drawing import Drawing, fault_of
from ...core.sketch.flow import Flow
from .objects import SceneError
from .raw_strokes import BEZIER, NURBS, RawStroke, raw_strokes, read_attribute, to_drawing
from .stroke_sheets import Sheet, active_sheet, sheets_of

SELECTION = ".selection"
"""Attribute in which Blender keeps what is selected; where it is absent, all is."""


class ChosenStroke(NamedTuple):
    """A stroke that a tool means.

    Attributes
    ----------
    layer : name of its layer, "" of a curve; number : its place in the layer's drawing
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
    selected = list(selected_strokes(sketch))
    said = []
    if any(not sheet.fault for sheet, _ in selected):
        kept_out = sum(len(numbers) for sheet, numbers in selected if sheet.fault)
        if kept_out:
            said.append(f"Left out {kept_out} selected stroke(s) in locked or hidden layers")
        pairs = [(sheet, numbers) for sheet, numbers in selected if not sheet.fault]
    elif selected:
        raise SceneError(f"{selected[0][0].fault}: the selected strokes are in it")
    else:
        sheet = active_sheet(sketch)
        pairs = [(sheet, list(range(len(bounds_of(sheet.drawing)) - 1)))]
    found = [stroke for sheet, numbers in pairs for stroke in read(sheet, numbers)]
    usable = [stroke for stroke in found if not fault_of(stroke.drawing)]
    if not usable:
        raise SceneError("None of these strokes has a length: draw a longer one first")
    if len(usable) < len(found):
        said.append(f"Left out {len(found) - len(usable)} stroke(s) without length")
    return usable, said


def selected_strokes(sketch: bpy.types.Object) -> Iterator[tuple[Sheet, list[int]]]:
    """Yield where there are selected strokes at the current frame, and which these are.

    A stroke is selected if one of its points is. Outside Edit Mode nothing shows what is, so that
    layers of which all is selected, as new ones are, say nothing.
    """
    is_seen = sketch.mode == "EDIT"
    sheets = sheets_of(sketch)
    flags = [flags_of(sheet.drawing) for sheet in sheets]
    if not is_seen and all(selected.all() for selected in flags):
        return
    for sheet, selected in zip(sheets, flags, strict=True):
        if selected.any():
            yield sheet, np.flatnonzero(selected).tolist()


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


def read(sheet: Sheet, numbers: Sequence[int]) -> Iterator[ChosenStroke]:
    """Yield strokes of a layer or of curves, in the world. Splines are read as polylines."""
    strokes = list(raw_strokes(sheet.drawing, sheet.drawing.curve_offsets))
    for number in numbers:
        stroke = strokes[number]
        drawing = open_drawing(stroke, sheet.matrix)
        flow = stroke.flow or Flow()
        yield ChosenStroke(sheet.name, number, drawing, len(stroke.points), flow)


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
