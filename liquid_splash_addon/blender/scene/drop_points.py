# SPDX-License-Identifier: GPL-3.0-or-later
"""The free drops of a splash as a point cloud, including those too small for the mesh.

The object is a mesh of single vertices, which a modifier turns into a point cloud: before Blender 5
a script cannot set the size of a point cloud. The modifier passes the vertices on as well: renders
show the points alone, exporters write the vertices alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from mathutils import Matrix

from ..data import opened_files
from . import mesh_space, node_groups
from .material import water_material
from .mesh_object import flat

if TYPE_CHECKING:
    from ...core.composition.drops import Drops

NAME = "Splash Drops"

MARK = "splash_drops"
"""Custom property by which the node group is found, whatever it is called: its version."""

VERSION = 3
"""Of the node group; those of version 1 made points alone, of water up to 2."""

ALL = "All Drops"
"""Input of the modifier: show also the drops that are part of the splash's mesh."""

MATERIAL = "Material"
"""Input of the modifier: of the points."""


def own_points(splash: bpy.types.Object) -> bpy.types.Object | None:
    """Return the object for the drops of ``splash`` alone; None if there is none.

    A copy of a splash refers to the drops of the original, which are not its own. In files from
    before owners were kept, drops belong to their parent.
    """
    item = splash.splash_stack.points
    if item is None or not item.users_scene or item.type != "MESH":
        return None
    owner = item.splash.owner or item.parent
    return item if owner == splash else None


def points_of(splash: bpy.types.Object) -> bpy.types.Object | None:
    """Return the object that holds the drops of ``splash``; None if it cannot be written."""
    item = own_points(splash)
    if item is None:
        return None
    return item if item.mode == "OBJECT" and item.is_editable and item.data.is_editable else None


def ensure(splash: bpy.types.Object) -> None:
    """Give ``splash`` a child object for its drops, still empty, unless it has one."""
    if own_points(splash) is not None:
        return
    item = bpy.data.objects.new(NAME, bpy.data.meshes.new(NAME))
    for collection in splash.users_collection:
        collection.objects.link(item)
    item.parent = item.splash.owner = splash
    item.matrix_parent_inverse = Matrix(mesh_space.space_of(splash.data).tolist())
    item.modifiers.new(NAME, "NODES").node_group = node_group()
    splash.splash_stack.points = item
    slots = splash.material_slots
    material = slots[0].material if slots else None
    give(splash, water_material() if material is None else material)


def give(splash: bpy.types.Object, material: bpy.types.Material) -> None:
    """Give the drops of a splash or a model a material, where they can be changed."""
    item = own_points(splash)
    if item is None or not item.is_editable or not item.data.is_editable:
        return
    if item.material_slots:
        item.material_slots[0].material = material
    else:
        item.data.materials.append(material)
    for modifier in item.modifiers:
        if modifier.type == "NODES" and modifier.node_group and MARK in modifier.node_group:
            node_groups.set_input(modifier, MATERIAL, material)


def write(splash: bpy.types.Object, drops: Drops | None) -> None:
    """Replace the drops of ``splash`` if it has an object for them."""
    item = points_of(splash)
    if item is None:
        return
    data = item.data
    data.clear_geometry()
    data.splash_liquid.time_scale = 1.0
    if drops is None:
        return
    data.vertices.add(len(drops.positions))
    data.vertices.foreach_set("co", flat(drops.positions))
    for name, kind, field, values in (
        ("velocity", "FLOAT_VECTOR", "vector", flat(drops.velocities)),
        ("radius", "FLOAT", "value", flat(drops.radii)),
        ("meshed", "BOOLEAN", "value", np.ascontiguousarray(drops.meshed)),
    ):
        data.attributes.new(name, kind, "POINT").data.foreach_set(field, values)
    data.update()


def node_group() -> bpy.types.NodeTree:
    """Return the node group that turns vertices into points; make it if there is none."""
    found = node_groups.marked(MARK)
    if found is not None:
        if found[MARK] < VERSION:
            update_group(found)
        return found
    group = node_groups.new(NAME, {ALL: "NodeSocketBool"})
    group[MARK] = 1
    add_nodes(group)
    update_group(group)
    return group


def add_nodes(group: bpy.types.NodeTree) -> None:
    """Fill the group: a point for each drop that is in no mesh, and for all with *All Drops* on."""
    nodes, links = group.nodes, group.links
    begin, end = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    points = nodes.new("GeometryNodeMeshToPoints")
    radius = node_groups.named(group, "FLOAT", "radius")
    meshed = node_groups.named(group, "BOOLEAN", "meshed")
    wanted = nodes.new("FunctionNodeBooleanMath")
    wanted.operation = "IMPLY"  # in the mesh -> shown only if all are
    material = nodes.new("GeometryNodeSetMaterial")
    material.inputs["Material"].default_value = water_material()
    links.new(meshed.outputs["Attribute"], wanted.inputs[0])
    links.new(begin.outputs[ALL], wanted.inputs[1])
    links.new(begin.outputs["Geometry"], points.inputs["Mesh"])
    links.new(wanted.outputs[0], points.inputs["Selection"])
    links.new(radius.outputs["Attribute"], points.inputs["Radius"])
    links.new(points.outputs[0], material.inputs["Geometry"])
    links.new(material.outputs[0], end.inputs["Geometry"])


def update_group(group: bpy.types.NodeTree) -> None:
    """Make a group of an older version one of VERSION."""
    version, group[MARK] = group[MARK], VERSION
    if version < 2:
        pass_vertices(group)
    add_material(group)


def pass_vertices(group: bpy.types.NodeTree) -> None:
    """Let the wanted vertices themselves pass beside their points, in a group of version 1.

    A group that somebody has rebuilt stays as it is.
    """
    nodes, links = group.nodes, group.links
    makers = [node for node in nodes if node.bl_idname == "GeometryNodeMeshToPoints"]
    ends = [node for node in nodes if node.bl_idname == "NodeGroupOutput" and node.is_active_output]
    if len(makers) != 1 or len(ends) != 1:
        return
    sources = [(makers[0].inputs[name], name) for name in ("Mesh", "Selection")]
    if not ends[0].inputs[0].is_linked or not all(socket.is_linked for socket, _ in sources):
        return
    mesh, wanted = (socket.links[0].from_socket for socket, _ in sources)
    rest, join = nodes.new("GeometryNodeDeleteGeometry"), nodes.new("GeometryNodeJoinGeometry")
    unwanted = nodes.new("FunctionNodeBooleanMath")
    unwanted.operation = "NOT"
    points = ends[0].inputs[0].links[0].from_socket
    links.new(wanted, unwanted.inputs[0])
    links.new(mesh, rest.inputs["Geometry"])
    links.new(unwanted.outputs[0], rest.inputs["Selection"])
    links.new(rest.outputs[0], join.inputs[0])
    links.new(points, join.inputs[0])
    links.new(join.outputs[0], ends[0].inputs[0])


def add_material(group: bpy.types.NodeTree) -> None:
    """Let each object choose the material of its points, in a group of version 1 or 2.

    A group that somebody has rebuilt stays as it is; objects keep the material that they had.
    """
    makers = [node for node in group.nodes if node.bl_idname == "GeometryNodeSetMaterial"]
    begins = [node for node in group.nodes if node.bl_idname == "NodeGroupInput"]
    if len(makers) != 1 or not begins or makers[0].inputs["Material"].is_linked:
        return
    material = makers[0].inputs["Material"].default_value
    group.interface.new_socket(MATERIAL, in_out="INPUT", socket_type="NodeSocketMaterial")
    group.links.new(begins[0].outputs[MATERIAL], makers[0].inputs["Material"])
    for item in bpy.data.objects:
        for modifier in item.modifiers if item.is_editable else ():
            if modifier.type == "NODES" and modifier.node_group == group:
                node_groups.set_input(modifier, MATERIAL, material)


@bpy.app.handlers.persistent
def update_groups(_file: Any = None, _unused: Any = None) -> None:
    """Update the node groups of an old file that was opened or appended from."""
    for group in bpy.data.node_groups:
        if MARK in group and group[MARK] < VERSION and group.is_editable:
            update_group(group)


def register() -> None:
    """Update the node groups of what is open, and of what will be."""
    opened_files.listen(update_groups)


def unregister() -> None:
    """Leave node groups alone."""
    opened_files.ignore(update_groups)
