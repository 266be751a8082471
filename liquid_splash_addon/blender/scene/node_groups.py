# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups of geometry nodes that the add-on makes, one of each in a file, and their modifiers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy


def marked(mark: str, version: int | None = None) -> bpy.types.NodeTree | None:
    """Find the file's own group that has the custom property ``mark``; None if there is none.

    version : the value that the property must have; None for any
    """
    for group in bpy.data.node_groups:
        if mark in group and group.library is None and version in (None, group[mark]):
            return group
    return None


def new(name: str, inputs: Mapping[str, str]) -> bpy.types.NodeTree:
    """Make a group for modifiers, still without nodes.

    inputs : type of the socket of each input, by its name, beside the geometry
    """
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    group.is_modifier = True
    sockets = [("Geometry", "INPUT", "NodeSocketGeometry")]
    sockets += [(label, "INPUT", kind) for label, kind in inputs.items()]
    sockets += [("Geometry", "OUTPUT", "NodeSocketGeometry")]
    for label, direction, kind in sockets:
        group.interface.new_socket(label, in_out=direction, socket_type=kind)
    return group


def named(group: bpy.types.NodeTree, kind: str, name: str) -> bpy.types.Node:
    """Add a node that reads an attribute."""
    node = group.nodes.new("GeometryNodeInputNamedAttribute")
    node.data_type = kind
    node.inputs["Name"].default_value = name
    return node


def set_input(modifier: bpy.types.Modifier, name: str, value: Any) -> None:
    """Set the input called ``name`` of a modifier, unless it is that already or was removed."""
    sockets = [item for item in modifier.node_group.interface.items_tree if item.name == name]
    if not sockets:
        return
    identifier = sockets[0].identifier
    if hasattr(modifier, "properties"):  # from Blender 5.2 on
        holder = getattr(modifier.properties.inputs, identifier)
        if holder.value == value:
            return
        holder.value = value
    elif modifier.get(identifier) != value:
        modifier[identifier] = value
    modifier.id_data.update_tag()  # Blender itself does not notice
