# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes drawn in the world into a sketch, wherever the sketch stands; and out of it again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import bpy
import numpy as np

from ...core.sketch.drawing import Drawing
from .grease_pencil import is_hidden, layer_matrix
from .objects import Handle
from .raw_strokes import read_attribute
from .sketch import INK_RADIUS, add_strokes, new_sketch
from .targets import find_target

LAYER = "Hand"
"""Name of the layer that is made where none can be drawn on."""


class Written(NamedTuple):
    """A stroke in a sketch, to be found again.

    Attributes
    ----------
    sketch : the object
    layer : name of its layer
    points : float32 ``(n, 3)`` in the layer's space, as they were written
    """

    sketch: Handle
    layer: str
    points: np.ndarray


def sketch_to_draw_on(context: bpy.types.Context) -> bpy.types.Object:
    """Return the sketch that the buttons mean; a new one where there is none or it is linked."""
    target = find_target(context)
    if target is not None and can_be_drawn_on(target.sketch):
        return target.sketch
    return fresh_sketch(context)


def can_be_drawn_on(item: bpy.types.Object) -> bool:
    """Whether strokes can be added to an object with strokes: not to curves, nor to linked ones."""
    return item.type == "GREASEPENCIL" and item.is_editable and item.data.is_editable


def fresh_sketch(context: bpy.types.Context) -> bpy.types.Object:
    """Make a new sketch and make it the active object."""
    sketch = new_sketch(context)
    context.view_layer.objects.active = sketch
    context.view_layer.update()
    return sketch


def layer_to_draw_on(sketch: bpy.types.Object, frame: int) -> Any:
    """Return the active layer, else the first, with a drawing; a new one if both are locked."""
    layers = sketch.data.layers
    candidates = [*filter(None, [layers.active]), *layers]
    layer = next((item for item in candidates if not (item.lock or is_hidden(item))), None)
    if layer is None:
        layer = layers.new(LAYER)
        layer.use_lights = False
    if layer.current_frame() is None:
        layer.frames.new(frame)
    return layer


def write_stroke(
    context: bpy.types.Context,
    sketch: bpy.types.Object,
    drawing: Drawing,
    radius: float = INK_RADIUS,
) -> Written:
    """Append a stroke, in the world, to a sketch, and return where it is.

    radius : of the line at full pressure, in world units
    """
    layer = layer_to_draw_on(sketch, context.scene.frame_current)
    matrix = layer_matrix(sketch, layer)
    inverse = np.linalg.inv(matrix)
    points = drawing.points @ inverse[:3, :3].T + inverse[:3, 3]
    stretch = float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
    add_strokes(sketch, [replace(drawing, points=points)], layer, radius / stretch)
    sketch.update_tag()
    return Written(Handle.of(sketch), layer.name, points.astype(np.float32))


def remove_stroke(written: Written) -> bool:
    """Remove a stroke from its sketch; False if it is no longer there as it was drawn."""
    sketch = written.sketch.find()
    layer = None if sketch is None else sketch.data.layers.get(written.layer)
    frame = None if layer is None else layer.current_frame()
    if frame is None or not len(frame.drawing.curve_offsets):
        return False
    number = place_of(frame.drawing, written.points)
    if number is None:
        return False
    frame.drawing.remove_strokes(indices=[number])
    sketch.update_tag()
    return True


def place_of(drawing: Any, points: np.ndarray) -> int | None:
    """Return the number of the last stroke that has exactly these points ``(n, 3)``."""
    everything = read_attribute(drawing, "position")
    offsets = np.empty(len(drawing.curve_offsets), dtype=np.int32)
    drawing.curve_offsets.foreach_get("value", offsets)
    for number in reversed(range(len(offsets) - 1)):
        first, last = offsets[number : number + 2]
        if last - first == len(points) and np.array_equal(everything[first:last], points):
            return number
    return None
