# SPDX-License-Identifier: GPL-3.0-or-later
"""Ballistic preview: a modifier by which every vertex flies on by itself over the timeline.

It moves vertices and free drops to p + v t + g t^2 / 2, where v is their ``velocity``, t the time
since the frame at which the splash has the drawn shape, and g points down in the world. Before
that frame they fly backwards. ``velocity`` becomes v + g t. Nothing is baked: the modifier is all
there is, and it works without the add-on.
"""

from __future__ import annotations

from typing import Any

import bpy

from . import node_groups

NAME = "Splash Ballistics"

MARK = "splash_ballistics"
"""Custom property by which the node group is found, whatever it is called: its version."""

VERSION = 1

SHAPE_FRAME, GRAVITY, FRAME_RATE = "Shape Frame", "Gravity", "Frame Rate"
"""Inputs: frames; units of the object per second squared; frames per second."""


def modifier_of(item: bpy.types.Object) -> bpy.types.Modifier | None:
    """Return the preview's modifier on ``item``; None if there is none."""
    for modifier in item.modifiers:
        group = modifier.node_group if modifier.type == "NODES" else None
        if group is not None and MARK in group:
            return modifier
    return None


def ensure(item: bpy.types.Object) -> bpy.types.Modifier:
    """Give ``item`` the modifier, before all others, unless it has it."""
    modifier = modifier_of(item)
    if modifier is None:
        modifier = item.modifiers.new(NAME, "NODES")
        modifier.node_group = node_group()
        item.modifiers.move(len(item.modifiers) - 1, 0)
    return modifier


def remove(item: bpy.types.Object) -> None:
    """Take the modifier from ``item`` if it has one."""
    modifier = modifier_of(item)
    if modifier is not None:
        item.modifiers.remove(modifier)


def set_motion(
    modifier: bpy.types.Modifier, shape_frame: int, gravity: float, frame_rate: float
) -> None:
    """Set the inputs, see their names above."""
    for name, value in (
        (SHAPE_FRAME, shape_frame),
        (GRAVITY, gravity),
        (FRAME_RATE, frame_rate),
    ):
        node_groups.set_input(modifier, name, float(value))


def node_group() -> bpy.types.NodeTree:
    """Return the node group of this file; make it if there is none of this version."""
    found = node_groups.marked(MARK, VERSION)
    if found is not None:
        return found
    inputs = dict.fromkeys((SHAPE_FRAME, GRAVITY, FRAME_RATE), "NodeSocketFloat")
    group = node_groups.new(NAME, inputs)
    group[MARK] = VERSION
    fill(group)
    return group


class Nodes:
    """Adds nodes to a group, each with its inputs linked, and returns their first output."""

    def __init__(self, group: bpy.types.NodeTree) -> None:
        """Take a group of geometry nodes."""
        self.group = group

    def add(self, kind: str, *sources: Any, **settings: str) -> Any:
        """Add a node; a source is the output or the value of an input, None leaves it alone."""
        node = self.group.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for socket, source in zip(node.inputs, sources, strict=False):
            self.feed(socket, source)
        return node.outputs[0]

    def math(self, operation: str, *sources: Any) -> Any:
        """Add a node that calculates with numbers."""
        return self.add("ShaderNodeMath", *sources, operation=operation)

    def vectors(self, operation: str, *sources: Any) -> Any:
        """Add a node that calculates with vectors."""
        return self.add("ShaderNodeVectorMath", *sources, operation=operation)

    def scaled(self, vector: Any, factor: Any) -> Any:
        """Add a node that multiplies a vector by a number."""
        node = self.vectors("SCALE", vector).node
        self.feed(node.inputs["Scale"], factor)
        return node.outputs[0]

    def feed(self, socket: bpy.types.NodeSocket, source: Any) -> None:
        """Link an input to an output, or give it a value."""
        if isinstance(source, bpy.types.NodeSocket):
            self.group.links.new(source, socket)
        elif source is not None:
            socket.default_value = source


def fill(group: bpy.types.NodeTree) -> None:
    """Add all nodes to an empty group."""
    nodes = Nodes(group)
    begin = group.nodes.new("NodeGroupInput").outputs
    seconds = seconds_flown(nodes, begin[SHAPE_FRAME], begin[FRAME_RATE])
    gained = nodes.scaled(nodes.scaled(downward(nodes), begin[GRAVITY]), seconds)  # g t
    velocity = node_groups.named(group, "FLOAT_VECTOR", "velocity").outputs["Attribute"]
    mean = nodes.vectors("ADD", velocity, nodes.scaled(gained, 0.5))
    moved = nodes.add(
        "GeometryNodeSetPosition", begin["Geometry"], None, None, nodes.scaled(mean, seconds)
    )
    stored = nodes.add(
        "GeometryNodeStoreNamedAttribute", moved, None, "velocity",
        nodes.vectors("ADD", velocity, gained), data_type="FLOAT_VECTOR", domain="POINT",
    )  # fmt: skip
    group.links.new(stored, group.nodes.new("NodeGroupOutput").inputs["Geometry"])


def seconds_flown(nodes: Nodes, shape_frame: Any, frame_rate: Any) -> Any:
    """Return the seconds since the shape frame.

    The nodes know no frame rate, but frame and seconds of the scene. At frame 0, where both are 0
    (and their quotient 0 too, as Blender divides), the input has to do.
    """
    now = nodes.add("GeometryNodeInputSceneTime").node.outputs
    at_zero = nodes.math("DIVIDE", nodes.math("COMPARE", now["Frame"], 0.0, 1e-6), frame_rate)
    elsewhere = nodes.math("DIVIDE", now["Seconds"], now["Frame"])
    frames = nodes.math("SUBTRACT", now["Frame"], shape_frame)
    return nodes.math("MULTIPLY", frames, nodes.math("ADD", at_zero, elsewhere))


def downward(nodes: Nodes) -> Any:
    """Return the world's downward direction in the object's own space."""
    own = nodes.add("GeometryNodeObjectInfo", nodes.add("GeometryNodeSelfObject")).node
    to_own = nodes.add("FunctionNodeInvertMatrix", own.outputs["Transform"])
    return nodes.vectors(
        "NORMALIZE", nodes.add("FunctionNodeTransformDirection", (0.0, 0.0, -1.0), to_own)
    )
