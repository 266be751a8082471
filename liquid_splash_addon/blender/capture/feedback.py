# SPDX-License-Identifier: GPL-3.0-or-later
"""What one sees while drawing, in the headset and in the 3D views: wet ink, pens and messages.

They are objects of the scene that no render shows, in a collection that goes when drawing ends.
Drawing them by a handler of the XR region would be simpler, but with one Blender 5.2 crashes at the
first undo or redo in a running session, whatever the handler does.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, Protocol

import bpy
import numpy as np
from mathutils import Matrix, Quaternion, Vector

from ...core.sketch.drawing import Drawing
from ...core.sketch.recording import Pen, Pose, Recording
from ...core.sketch.speed_colours import level_colours, pieces_of
from ..jobs import draft_then_full
from ..scene.sketch import INK_RADIUS, add_strokes, new_sketch

COLLECTION = "Splash VR"
WET_INK, MESSAGE, MATERIAL = "Splash Wet Ink", "Splash VR Message", "Splash VR Colour"
PENS = ("Splash Pen Left", "Splash Pen Right")

PEN_RADIUS, LETTER = 0.006, 0.035
"""Of a pen's tip, and height of letters: metres of the hand."""

PEN_COLOUR = (1.0, 1.0, 1.0, 1.0)


class Shown(Protocol):
    """What is shown: see vr_drawing.DrawingSession."""

    pens: list[Pen]
    poses: list[Pose | None]
    message: Any


def is_ours(item: bpy.types.Object) -> bool:
    """Whether an object is one of those that are only shown while one draws."""
    return any(collection.name == COLLECTION for collection in item.users_collection)


def show(context: bpy.types.Context, shown: Shown) -> None:
    """Show how things are now."""
    if context.scene.collection.children.get(COLLECTION) is None:
        make(context)
    show_ink(shown.pens)
    for name, pose in zip(PENS, shown.poses, strict=True):
        if pose is not None:
            place(name, Matrix.LocRotScale(Vector(pose.point), None, Vector([pose.scale] * 3)))
    show_message(context, shown)


def hide() -> None:
    """Remove it all: also what an undo has brought back, or a file was saved with."""
    collection = bpy.data.collections.get(COLLECTION)
    if collection is None:
        return
    for item in list(collection.objects):
        data = item.data
        bpy.data.objects.remove(item)
        bpy.data.batch_remove([data])
    bpy.data.collections.remove(collection)
    bpy.data.batch_remove([item for item in bpy.data.materials if item.name.startswith(MATERIAL)])


def make(context: bpy.types.Context) -> None:
    """Add the objects: those of a scene that was in another state are gone."""
    hide()
    collection = bpy.data.collections.new(COLLECTION)
    ink = new_sketch(context, Matrix())
    ink.name = WET_INK
    ink.data.materials.clear()
    for material in ink_materials():
        ink.data.materials.append(material)
    for other in list(ink.users_collection):
        other.objects.unlink(ink)
    text = bpy.data.curves.new(MESSAGE, "FONT")
    text.size, text.align_x = LETTER, "CENTER"
    ball = ball_mesh()
    items = [ink, bpy.data.objects.new(MESSAGE, text)]
    items += [bpy.data.objects.new(name, ball.copy()) for name in PENS]
    bpy.data.meshes.remove(ball)
    white = bpy.data.materials.new(MATERIAL)
    white.diffuse_color = PEN_COLOUR
    for item in items:
        collection.objects.link(item)
        if item is not ink:
            item.data.materials.append(white)
        item.show_in_front = item.hide_render = item.hide_select = True
    context.scene.collection.children.link(collection)


def ball_mesh() -> bpy.types.Mesh:
    """Return an octahedron, for the tip of a pen."""
    mesh = bpy.data.meshes.new("Splash Pen")
    corners = PEN_RADIUS * np.concatenate([np.eye(3), -np.eye(3)])
    faces = [(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)]
    mesh.from_pydata(corners.tolist(), [], faces)
    return mesh


def place(name: str, matrix: Matrix) -> None:
    """Move an object, unless it is there already: a move costs an update of the scene."""
    item = bpy.data.objects.get(name)
    if item is not None and item.matrix_basis != matrix:
        item.matrix_basis = matrix


def show_ink(pens: Sequence[Pen]) -> None:
    """Show the strokes that are being drawn, coloured by the speed of the hand."""
    item = bpy.data.objects.get(WET_INK)
    if item is None:
        return
    wet = [pen.recording for pen in pens if pen.recording and len(pen.recording.poses) > 1]
    drawing = item.data.layers[0].frames[0].drawing
    count = len(drawing.attributes["position"].data) if len(drawing.curve_offsets) > 1 else 0
    if count == sum(len(recording.poses) for recording in wet):
        return
    if count:
        drawing.remove_strokes()
    if wet:
        add_pieces(item, drawing, wet)
    item.data.update_tag()


def add_pieces(item: bpy.types.Object, drawing: Any, wet: Sequence[Recording]) -> None:
    """Add strokes in pieces of one speed, each with its material.

    Solid shading shows no colours of points beside those of materials.
    """
    pieces, levels = [], []
    for recording in wet:
        whole = recording.drawing()
        for first, last, level in pieces_of(np.array(recording.speeds)):
            part = slice(first, last + 1)
            pieces.append(Drawing(whole.points[part], None, np.asarray(whole.pressures)[part]))
            levels.append(level)
    add_strokes(item, pieces, radius=INK_RADIUS * wet[0].poses[0].scale)
    known = drawing.attributes.get("material_index")
    attribute = known or drawing.attributes.new("material_index", "INT", "CURVE")
    attribute.data.foreach_set("value", levels)


def ink_materials() -> list[bpy.types.Material]:
    """Make the materials of wet ink, from slow to fast."""
    made = []
    for colour in level_colours():
        material = bpy.data.materials.new(MATERIAL)
        bpy.data.materials.create_gpencil_data(material)
        material.grease_pencil.color = colour
        made.append(material)
    return made


def text_to_show(shown: Shown) -> str:
    """Return the message, else how far the splash is; "" for nothing."""
    message = shown.message
    if message is not None and time.monotonic() < message.until:
        return str(message.text)
    making = draft_then_full.making()
    if making is None or not making.is_busy:
        return ""
    stage, fraction = making.progress
    return f"{making.stage.capitalize()}: {stage} ({fraction:.0%})"


def show_message(context: bpy.types.Context, shown: Shown) -> None:
    """Show the message above the pen of its hand, facing the viewer."""
    item = bpy.data.objects.get(MESSAGE)
    pose = shown.poses[shown.message.hand if shown.message is not None else 1]
    if item is None or pose is None:
        return
    text = text_to_show(shown)
    if item.data.body != text:
        item.data.body = text
    if text:
        state = context.window_manager.xr_session_state
        facing = Quaternion(state.viewer_pose_rotation)
        above = facing @ Vector((0, 2 * LETTER * pose.scale, 0))
        size = Vector([pose.scale] * 3)
        place(MESSAGE, Matrix.LocRotScale(Vector(pose.point) + above, facing, size))
