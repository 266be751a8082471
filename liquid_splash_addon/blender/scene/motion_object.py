# SPDX-License-Identifier: GPL-3.0-or-later
"""The object that plays simulated frames: a node group that imports one file a frame.

Blender's own nodes do it all, so that a file plays and renders where this add-on is not installed,
and in a Blender that was built without Alembic. What is imported stays in Blender's memory cache:
the second time round a frame of 150,000 vertices takes less than a millisecond, where a Mesh
Sequence Cache reads it again.
"""

from __future__ import annotations

from typing import Any

import bpy

from ...core.playback.playback import FILE
from ...core.playback.ply import RADIUS, VELOCITY
from . import node_groups
from .ballistics import Nodes
from .material import water_material

NAME = "Splash Motion"

MARK = "splash_motion"
"""Custom property by which the node group is found, whatever it is called: its version."""

VERSION = 1

FOLDER, START, FRAMES, MATERIAL = "Folder", "Start", "Frames", "Material"
"""Inputs: folder of the frames, where // is the folder of the file; frame of the scene that shows
the first one; how many there are (before and after them the liquid stands); of liquid and drops."""

INPUTS = {
    FOLDER: "NodeSocketString",
    START: "NodeSocketInt",
    FRAMES: "NodeSocketInt",
    MATERIAL: "NodeSocketMaterial",
}


def own_motion(splash: bpy.types.Object) -> bpy.types.Object | None:
    """Return the object that plays the frames of ``splash``; None if there is none.

    A copy of a splash refers to that of the original, which is not its own.
    """
    item = splash.splash_simulation.motion
    if item is None or not item.users_scene or item.type != "MESH" or not item.is_editable:
        return None
    return item if item.splash.owner == splash else None


def new_object(splash: bpy.types.Object) -> bpy.types.Object:
    """Return a new object that plays frames in the space of ``splash``, as yet none."""
    item = bpy.data.objects.new(NAME, bpy.data.meshes.new(NAME))
    for collection in splash.users_collection:
        collection.objects.link(item)
    item.parent = item.splash.owner = splash
    add_modifier(item, splash)
    return item


def add_modifier(item: bpy.types.Object, splash: bpy.types.Object) -> None:
    """Give an object what makes it play frames, before all other modifiers."""
    modifier = item.modifiers.new(NAME, "NODES")
    modifier.node_group = node_group()
    item.modifiers.move(len(item.modifiers) - 1, 0)
    slots = splash.material_slots
    material = slots[0].material if slots and slots[0].material else water_material()
    node_groups.set_input(modifier, MATERIAL, material)


def show(item: bpy.types.Object, folder: str, start: int, frames: int) -> None:
    """Have an object play frames; it must have the modifier.

    folder : as it is stored; start : frame of the scene that shows the first; frames : how many.
    """
    modifier = modifier_of(item)
    for name, value in ((FOLDER, folder), (START, start), (FRAMES, frames)):
        node_groups.set_input(modifier, name, value)


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
    geometry = nodes.add("GeometryNodeSetShadeSmooth", geometry)
    geometry = with_drops(nodes, geometry)
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


def with_drops(nodes: Nodes, geometry: Any) -> Any:
    """Return a geometry with a point for every vertex that has a radius, beside the vertex.

    Renders show the points alone, exporters write the vertices alone.
    """
    radius = attribute(nodes, RADIUS)
    points = nodes.add("GeometryNodeMeshToPoints").node
    is_drop = nodes.math("GREATER_THAN", radius, 0.0)
    for name, source in (("Mesh", geometry), ("Selection", is_drop), ("Radius", radius)):
        nodes.feed(points.inputs[name], source)
    join = nodes.group.nodes.new("GeometryNodeJoinGeometry")
    for source in (points.outputs[0], geometry):
        nodes.feed(join.inputs[0], source)
    return join.outputs[0]


def whole(nodes: Nodes, operation: str, *sources: Any) -> Any:
    """Add a node that calculates with integers."""
    return nodes.add("FunctionNodeIntegerMath", *sources, operation=operation)


def attribute(nodes: Nodes, name: str) -> Any:
    """Add a node that reads an attribute of numbers."""
    return node_groups.named(nodes.group, "FLOAT", name).outputs["Attribute"]
