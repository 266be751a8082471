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
from .material import water_material

NAME = "Splash Motion"

MARK = "splash_motion"
"""Custom property by which the node group is found, whatever it is called: its version."""

VERSION = 1

INPUTS = (
    ("Folder", "NodeSocketString", "Folder of the frames; // is the folder of this file"),
    ("Start", "NodeSocketInt", "Frame of the scene that shows the first one"),
    ("Frames", "NodeSocketInt", "How many there are: before and after them the liquid stands"),
    ("Material", "NodeSocketMaterial", "Material of the liquid and its drops"),
)
"""Inputs of the modifier beside the geometry: name, kind, description."""


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
    set_input(item, "Material", material)


def show(item: bpy.types.Object, folder: str, start: int, frames: int) -> None:
    """Have an object play the ``frames`` of a ``folder`` from frame ``start`` of the scene on."""
    for name, value in (("Folder", folder), ("Start", start), ("Frames", frames)):
        if get_input(item, name) != value:
            set_input(item, name, value)


def modifier_of(item: bpy.types.Object) -> Any:
    """Return the modifier that plays frames; None if the user has removed it."""
    for modifier in item.modifiers:
        if modifier.type == "NODES" and modifier.node_group and MARK in modifier.node_group:
            return modifier
    return None


def set_input(item: bpy.types.Object, name: str, value: Any) -> None:
    """Set an input of the modifier, if it is there."""
    modifier = modifier_of(item)
    if modifier is None:
        return
    key = identifier(modifier.node_group, name)
    if bpy.app.version >= (5, 2, 0):
        getattr(modifier.properties.inputs, key).value = value
    else:
        modifier[key] = value
    item.update_tag()


def get_input(item: bpy.types.Object, name: str) -> Any:
    """Return an input of the modifier; None if it is not there."""
    modifier = modifier_of(item)
    if modifier is None:
        return None
    key = identifier(modifier.node_group, name)
    if bpy.app.version >= (5, 2, 0):
        return getattr(modifier.properties.inputs, key).value
    return modifier.get(key)


def identifier(group: bpy.types.NodeTree, name: str) -> str:
    """Return the identifier of an input of a node group."""
    sockets = group.interface.items_tree
    return str(next(s.identifier for s in sockets if s.name == name and s.in_out == "INPUT"))


def node_group() -> bpy.types.NodeTree:
    """Return the node group that plays frames; make it if there is none."""
    for group in bpy.data.node_groups:
        if group.get(MARK) == VERSION and group.library is None:
            return group
    group = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    group[MARK] = VERSION
    group.is_modifier = True
    new = group.interface.new_socket
    new("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    for name, kind, about in INPUTS:
        new(name, in_out="INPUT", socket_type=kind, description=about)
    new("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    Builder(group).build()
    return group


class Builder:
    """Fills the node group."""

    def __init__(self, group: bpy.types.NodeTree) -> None:
        """Take an empty node group with its sockets."""
        self.nodes, self.links = group.nodes, group.links
        self.begin = self.node("NodeGroupInput")

    def build(self) -> None:
        """Import the frame's file, give it velocity and material, show its drops as points."""
        geometry = self.imported(self.path())
        geometry = self.with_velocity(geometry)
        smooth = self.node("GeometryNodeSetShadeSmooth")
        self.links.new(geometry, smooth.inputs[0])
        geometry = self.with_drops(smooth.outputs[0])
        material = self.node("GeometryNodeSetMaterial")
        self.links.new(geometry, material.inputs["Geometry"])
        self.links.new(self.begin.outputs["Material"], material.inputs["Material"])
        end = self.node("NodeGroupOutput")
        self.links.new(material.outputs[0], end.inputs[0])

    def path(self) -> Any:
        """Return the path of the file of the scene's frame, the nearest that there is."""
        time, whole = self.node("GeometryNodeInputSceneTime"), self.node("FunctionNodeFloatToInt")
        whole.rounding_mode = "ROUND"  # motion blur looks half a shutter before and after
        self.links.new(time.outputs["Frame"], whole.inputs[0])
        since = self.integer("SUBTRACT", whole.outputs[0], self.begin.outputs["Start"])
        last = self.integer("SUBTRACT", self.begin.outputs["Frames"], 1)
        number = self.integer("MAXIMUM", self.integer("MINIMUM", since, last), 0)
        text = self.node("FunctionNodeFormatString")
        text.format_items.new("STRING", "folder")
        text.format_items.new("INT", "number")
        text.inputs["Format"].default_value = "{folder}/" + FILE
        self.links.new(self.begin.outputs["Folder"], text.inputs["folder"])
        self.links.new(number, text.inputs["number"])
        return self.if_there(text.outputs[0])

    def if_there(self, path: Any) -> Any:
        """Return ``path`` if there are frames, else "", of which the importer makes nothing."""
        some = self.node("FunctionNodeCompare")
        some.data_type, some.operation = "INT", "GREATER_THAN"
        self.links.new(self.begin.outputs["Frames"], enabled(some.inputs, "A"))
        switch = self.node("GeometryNodeSwitch")
        switch.input_type = "STRING"
        self.links.new(some.outputs[0], enabled(switch.inputs, "Switch"))
        self.links.new(path, enabled(switch.inputs, "True"))
        return enabled(switch.outputs, "Output")

    def imported(self, path: Any) -> Any:
        """Return the mesh of the file."""
        node = self.node("GeometryNodeImportPLY")
        self.links.new(path, node.inputs["Path"])
        return node.outputs[0]

    def with_velocity(self, geometry: Any) -> Any:
        """Return a geometry with the one attribute of which Cycles and exporters know."""
        vector = self.node("ShaderNodeCombineXYZ")
        for socket, name in zip(vector.inputs, VELOCITY, strict=True):
            self.links.new(self.named(name), socket)
        store = self.node("GeometryNodeStoreNamedAttribute")
        store.data_type, store.domain = "FLOAT_VECTOR", "POINT"
        store.inputs["Name"].default_value = "velocity"
        self.links.new(geometry, store.inputs["Geometry"])
        self.links.new(vector.outputs[0], enabled(store.inputs, "Value"))
        geometry = store.outputs[0]
        for name in VELOCITY:
            remove = self.node("GeometryNodeRemoveAttribute")
            remove.inputs["Name"].default_value = name
            self.links.new(geometry, remove.inputs["Geometry"])
            geometry = remove.outputs[0]
        return geometry

    def with_drops(self, geometry: Any) -> Any:
        """Return a geometry with a point for every vertex that has a radius, beside the vertex.

        Renders show the points alone, exporters write the vertices alone.
        """
        is_drop = self.node("FunctionNodeCompare")
        is_drop.data_type, is_drop.operation = "FLOAT", "GREATER_THAN"
        radius = self.named(RADIUS)
        self.links.new(radius, enabled(is_drop.inputs, "A"))
        points = self.node("GeometryNodeMeshToPoints")
        self.links.new(geometry, points.inputs["Mesh"])
        self.links.new(is_drop.outputs[0], points.inputs["Selection"])
        self.links.new(radius, points.inputs["Radius"])
        join = self.node("GeometryNodeJoinGeometry")
        self.links.new(points.outputs[0], join.inputs[0])
        self.links.new(geometry, join.inputs[0])
        return join.outputs[0]

    def integer(self, operation: str, first: Any, second: Any) -> Any:
        """Return the result of an operation on two integers, sockets or the second a number."""
        node = self.node("FunctionNodeIntegerMath")
        node.operation = operation
        self.links.new(first, node.inputs[0])
        if isinstance(second, int):
            node.inputs[1].default_value = second
        else:
            self.links.new(second, node.inputs[1])
        return node.outputs[0]

    def named(self, name: str) -> Any:
        """Return an attribute of numbers."""
        node = self.node("GeometryNodeInputNamedAttribute")
        node.data_type = "FLOAT"
        node.inputs["Name"].default_value = name
        return enabled(node.outputs, "Attribute")

    def node(self, kind: str) -> Any:
        """Add a node, to the right of the last."""
        node = self.nodes.new(kind)
        node.location.x = 170 * len(self.nodes)
        return node


def enabled(sockets: Any, name: str) -> Any:
    """Return the socket of that name which is in use: a node has one for every type of data."""
    return next(socket for socket in sockets if socket.name == name and socket.enabled)
