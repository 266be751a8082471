# SPDX-License-Identifier: GPL-3.0-or-later
"""Grease Pencil objects to draw a splash with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import bpy
import numpy as np
from mathutils import Matrix

from ...core.sketch.drawing import Drawing
from .objects import enter_object_mode, select_only
from .raw_strokes import SPEED

INK = "Splash Ink"
INK_COLOUR = (0.02, 0.25, 0.8, 1.0)
INK_RADIUS = 0.01
"""Radius of a stroke at full pressure, in Blender units."""


class Placement(NamedTuple):
    """How Blender turns the pen's place on the screen into one in space.

    label, about : for menus; placement, lock_axis : Blender's settings of those names
    """

    label: str
    about: str
    placement: str
    lock_axis: str


PLACEMENTS = {
    "CURSOR": Placement(
        "Cursor Depth",
        "On a plane through the 3D cursor that faces the view: turn the view between strokes",
        "CURSOR",
        "VIEW",
    ),
    "FRONT": Placement(
        "Front Plane", "On the upright plane X-Z through the 3D cursor", "CURSOR", "AXIS_Y"
    ),
    "SIDE": Placement(
        "Side Plane", "On the upright plane Y-Z through the 3D cursor", "CURSOR", "AXIS_X"
    ),
    "FLOOR": Placement(
        "Floor Plane", "On the level plane X-Y through the 3D cursor", "CURSOR", "AXIS_Z"
    ),
    "SURFACE": Placement(
        "Surface", "On the surface under the pen: of a bottle, of a face", "SURFACE", "VIEW"
    ),
}
"""Where strokes lie, by identifier."""


def new_sketch(
    context: bpy.types.Context, matrix: Matrix | None = None, layers: Sequence[str] = ("Strokes",)
) -> bpy.types.Object:
    """Make a Grease Pencil object with empty layers, by default at the 3D cursor.

    In the viewport it is drawn over the splash; renders do not show it.
    """
    is_legacy = bpy.app.version < (5, 0, 0)  # there grease_pencils are the annotations
    blocks = bpy.data.grease_pencils_v3 if is_legacy else bpy.data.grease_pencils
    data = blocks.new("Splash Sketch")
    data.materials.append(ink_material())
    data.stroke_depth_order = "3D"
    for name in layers:
        layer = data.layers.new(name)
        layer.use_lights = False
        layer.frames.new(context.scene.frame_current)
    sketch = bpy.data.objects.new("Splash Sketch", data)
    context.collection.objects.link(sketch)
    sketch.matrix_world = matrix or Matrix.Translation(context.scene.cursor.location)
    sketch.show_in_front = True
    sketch.hide_render = True
    sketch.use_grease_pencil_lights = False
    return sketch


def start_drawing(
    context: bpy.types.Context, sketch: bpy.types.Object, placement: str = "CURSOR"
) -> None:
    """Make ``sketch`` active and draw on it.

    placement : one of PLACEMENTS
    """
    enter_object_mode(context)
    select_only(context, sketch)
    tools, chosen = context.scene.tool_settings, PLACEMENTS[placement]
    tools.gpencil_stroke_placement_view3d = chosen.placement
    tools.gpencil_sculpt.lock_axis = chosen.lock_axis
    bpy.ops.object.mode_set(mode="PAINT_GREASE_PENCIL")


def is_sketch(item: bpy.types.Object | None) -> bool:
    """Whether an object was made for drawing splashes: it has their ink."""
    if item is None or item.type != "GREASEPENCIL":
        return False
    return any(
        slot.material is not None and slot.material.name == INK for slot in item.material_slots
    )


def ink_material() -> bpy.types.Material:
    """Return the material for sketches; make it if there is none."""
    material = bpy.data.materials.get(INK)
    if material is None or not material.is_grease_pencil or material.library is not None:
        material = bpy.data.materials.new(INK)
        bpy.data.materials.create_gpencil_data(material)
        material.grease_pencil.color = INK_COLOUR
    return material


def add_strokes(
    sketch: bpy.types.Object,
    drawings: Sequence[Drawing],
    layer: Any = None,
    radius: float = INK_RADIUS,
) -> None:
    """Append ``drawings``, in the sketch's own space, to a layer, by default the first one.

    Times become ``delta_time`` and pressures become thickness, as if drawn by hand.

    radius : of a stroke at full pressure, Blender units
    """
    drawing = (layer or sketch.data.layers[0]).current_frame().drawing
    before = len(drawing.attributes["position"].data) if len(drawing.curve_offsets) > 1 else 0
    drawing.add_strokes([len(d.points) for d in drawings])
    append_values(drawing, "position", before, np.concatenate([d.points for d in drawings]))
    times = [np.zeros(len(d.points)) if d.times is None else d.times for d in drawings]
    append_values(drawing, "delta_time", before, np.concatenate(times))
    pressures = [np.ones(len(d.points)) if d.pressures is None else d.pressures for d in drawings]
    append_values(drawing, "radius", before, radius * np.concatenate(pressures))
    append_values(drawing, "opacity", before, np.ones(sum(map(len, times))))
    if any(d.speeds is not None for d in drawings):
        nothing = np.nan
        speeds = [
            np.full(len(d.points), nothing) if d.speeds is None else d.speeds for d in drawings
        ]
        append_values(drawing, SPEED, before, np.concatenate(speeds))
    drawing.tag_positions_changed()


def append_values(drawing: Any, name: str, before: int, values: np.ndarray) -> None:
    """Write ``values`` into an attribute of all points but the first ``before``."""
    is_vector = values.ndim == 2
    kind, field = ("FLOAT_VECTOR", "vector") if is_vector else ("FLOAT", "value")
    attribute = drawing.attributes.get(name) or drawing.attributes.new(name, kind, "POINT")
    everything = np.zeros((len(attribute.data), *values.shape[1:]), dtype=np.float32)
    attribute.data.foreach_get(field, everything.ravel())
    everything[before:] = values
    attribute.data.foreach_set(field, everything.ravel())
