# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects that play simulated frames: a node group that imports one file a frame.

Blender's own nodes do it all, so that a file plays and renders where this add-on is not installed,
and in a Blender that was built without Alembic. What is imported stays in Blender's memory cache:
the second time round a frame of 150,000 vertices takes less than a millisecond, where a Mesh
Sequence Cache reads it again.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ...core.playback.files import FILE, RADIUS, VELOCITY
from ..data.look import METRES
from . import mesh_space, node_groups
from .ballistics import Nodes
from .material import water_material

NAME = "Splash Motion"
DROPS_NAME = "Splash Motion Drops"

MARK = "splash_motion"
"""Custom property by which the node group is found, whatever it is called: its version."""

VERSION = 1

FOLDER, START, FRAMES, DROPS, MATERIAL = "Folder", "Start", "Frames", "Drops", "Material"
"""Inputs: folder of the frames, where // is the folder of the file; frame of the scene that shows
the first one; how many there are (before and after them the liquid stands); whether to show drops
alone, or all else; of liquid or drops."""

INPUTS = {
    FOLDER: "NodeSocketString",
    START: "NodeSocketInt",
    FRAMES: "NodeSocketInt",
    DROPS: "NodeSocketBool",
    MATERIAL: "NodeSocketMaterial",
}


def players_of(splash: bpy.types.Object) -> list[bpy.types.Object]:
    """List the objects that play the frames of ``splash``: the liquid, its drops, if they exist.

    A copy of a splash refers to those of the original, which are not its own.
    """
    record = splash.splash_simulation
    return [item for item in (record.motion, record.drops) if is_own(item, splash)]


def is_own(item: bpy.types.Object | None, splash: bpy.types.Object) -> bool:
    """Whether an object is there, can be changed, and plays the frames of ``splash`` alone."""
    if item is None or not item.users_scene or item.type != "MESH" or not item.is_editable:
        return False
    return bool(item.splash.owner == splash)


def ensure(splash: bpy.types.Object) -> None:
    """Give ``splash`` what plays its frames.

    Drops have an object of their own: exporters write what has points beside its mesh twice.
    """
    record = splash.splash_simulation
    if not is_own(record.motion, splash):
        record.motion = new_object(splash, NAME)
    if not is_own(record.drops, splash):
        record.drops = new_object(splash, DROPS_NAME)
    for item, is_drops in ((record.motion, False), (record.drops, True)):
        if modifier_of(item) is None:
            add_modifier(item, splash, is_drops)


def new_object(splash: bpy.types.Object, name: str) -> bpy.types.Object:
    """Return a new object in the space of ``splash``."""
    item = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    for collection in splash.users_collection:
        collection.objects.link(item)
    item.parent = item.splash.owner = splash
    space = mesh_space.space_of(splash.data)
    item.matrix_parent_inverse = Matrix(space.tolist())
    if METRES in splash:  # in drawing space, as its frames are
        item[METRES] = splash[METRES] * float(np.cbrt(abs(np.linalg.det(space[:3, :3]))))
    return item


def add_modifier(item: bpy.types.Object, splash: bpy.types.Object, is_drops: bool) -> None:
    """Give an object what makes it play frames, before all other modifiers."""
    modifier = item.modifiers.new(NAME, "NODES")
    modifier.node_group = node_group()
    item.modifiers.move(len(item.modifiers) - 1, 0)
    slots = splash.material_slots
    material = slots[0].material if slots and slots[0].material else water_material()
    node_groups.set_input(modifier, MATERIAL, material)
    node_groups.set_input(modifier, DROPS, is_drops)


def show(splash: bpy.types.Object, folder: str, start: int, frames: int) -> None:
    """Have the frames of ``splash`` played.

    folder : as it is stored; start : frame of the scene that shows the first; frames : how many.
    """
    for item in players_of(splash):
        modifier = modifier_of(item)
        if modifier is not None:
            for name, value in ((FOLDER, folder), (START, start), (FRAMES, frames)):
                node_groups.set_input(modifier, name, value)


def set_folder(splash: bpy.types.Object, folder: str) -> None:
    """Have the same frames of ``splash`` played from another folder."""
    for item in players_of(splash):
        modifier = modifier_of(item)
        if modifier is not None:
            node_groups.set_input(modifier, FOLDER, folder)


def remove(splash: bpy.types.Object) -> None:
    """Delete what plays the frames of ``splash``."""
    for item in players_of(splash):
        bpy.data.meshes.remove(item.data)


def modifier_of(item: bpy.types.Object) -> Any:
    """Return the modifier that plays frames; None if the user has removed it."""
    for modifier in item.modifiers:
        if modifier.type == "NODES" and modifier.node_group and MARK in modifier.node_group:
            return modifier
    return None


def node_group() -> bpy.types.NodeTree:
    """Return the node group of this file; make it if there is none of this version."""
    found = node_groups.marked(MARK)
    if found is not None and found[MARK] == VERSION:
        return found
    group = node_groups.new(NAME, INPUTS)
    group[MARK] = VERSION
    fill(group)
    return group


def fill(group: bpy.types.NodeTree) -> None:
    """Import the frame's file, give it velocity and material, and show its drops as points."""
    nodes = Nodes(group)
    begin = group.nodes.new("NodeGroupInput").outputs
    geometry = nodes.add("GeometryNodeImportPLY", path(nodes, begin))
    geometry = with_velocity(nodes, geometry)
    geometry = chosen(nodes, geometry, begin[DROPS])
    geometry = nodes.add("GeometryNodeSetMaterial", geometry, None, begin[MATERIAL])
    group.links.new(geometry, group.nodes.new("NodeGroupOutput").inputs["Geometry"])


def path(nodes: Nodes, begin: Any) -> Any:
    """Return the path of the frame's file, the nearest that there is; "" if there is none."""
    time = nodes.add("GeometryNodeInputSceneTime").node.outputs["Frame"]
    # To the nearest: motion blur looks half a shutter before and after.
    now = nodes.add("FunctionNodeFloatToInt", time, rounding_mode="ROUND")
    since = whole(nodes, "SUBTRACT", now, begin[START])
    last = whole(nodes, "SUBTRACT", begin[FRAMES], 1)
    number = whole(nodes, "MAXIMUM", whole(nodes, "MINIMUM", since, last), 0)
    text = nodes.group.nodes.new("FunctionNodeFormatString")
    for kind, name, source in (("STRING", "folder", begin[FOLDER]), ("INT", "number", number)):
        text.format_items.new(kind, name)
        nodes.feed(text.inputs[name], source)
    text.inputs["Format"].default_value = "{folder}/" + FILE
    some = whole(nodes, "MINIMUM", begin[FRAMES], 1)  # an integer above 0 is true
    return nodes.add("GeometryNodeSwitch", some, "", text.outputs[0], input_type="STRING")


def with_velocity(nodes: Nodes, geometry: Any) -> Any:
    """Return a geometry with the one attribute of which Cycles and exporters know."""
    parts = [attribute(nodes, name) for name in VELOCITY]
    vector = nodes.add("ShaderNodeCombineXYZ", *parts)
    geometry = nodes.add(
        "GeometryNodeStoreNamedAttribute", geometry, None, "velocity", vector,
        data_type="FLOAT_VECTOR", domain="POINT",
    )  # fmt: skip
    for name in VELOCITY:
        node = nodes.add("GeometryNodeRemoveAttribute", geometry).node
        node.inputs["Name"].default_value = name
        geometry = node.outputs[0]
    return geometry


def chosen(nodes: Nodes, geometry: Any, drops: Any) -> Any:
    """Return the vertices that have a radius, each with a point beside it, or all else.

    Renders show the points alone, exporters write the vertices alone.
    """
    radius = attribute(nodes, RADIUS)
    is_drop = nodes.math("GREATER_THAN", radius, 0.0)
    parts = nodes.add("GeometryNodeSeparateGeometry", geometry, is_drop).node.outputs
    points = nodes.add("GeometryNodeMeshToPoints").node
    for name, source in (("Mesh", parts["Selection"]), ("Radius", radius)):
        nodes.feed(points.inputs[name], source)
    join = nodes.group.nodes.new("GeometryNodeJoinGeometry")
    for source in (points.outputs[0], parts["Selection"]):
        nodes.feed(join.inputs[0], source)
    liquid = nodes.add("GeometryNodeSetShadeSmooth", parts["Inverted"])
    return nodes.add("GeometryNodeSwitch", drops, liquid, join.outputs[0], input_type="GEOMETRY")


def whole(nodes: Nodes, operation: str, *sources: Any) -> Any:
    """Add a node that calculates with integers."""
    return nodes.add("FunctionNodeIntegerMath", *sources, operation=operation)


def attribute(nodes: Nodes, name: str) -> Any:
    """Add a node that reads an attribute of numbers."""
    return node_groups.named(nodes.group, "FLOAT", name).outputs["Attribute"]
