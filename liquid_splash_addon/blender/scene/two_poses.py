# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh of constant topology that moves as its velocities say, for solvers that read motion.

FLIP Fluids and other solvers take an object's velocity from where its vertices are on two frames.
"""

from __future__ import annotations

import bpy
import numpy as np

from .mesh_object import flat
from .places import world_matrix

KEY = "One Frame Before"
"""Name of the shape key that holds x - v dt, beside the basis x."""


def new_object(
    context: bpy.types.Context, origin: bpy.types.Object, frame: int
) -> bpy.types.Object:
    """Make a copy of the mesh of ``origin`` that passes its shape at ``frame`` with its velocity.

    The shape key is animated linearly from the frame before to the one after, so that solvers read
    the same velocity whether they look forward or back. Modifiers and obstacles stay behind.
    """
    scene, mesh = context.scene, origin.data.copy()
    mesh.splash_liquid.content = b""
    mesh.name = name = f"{origin.name} Two Poses"
    item = bpy.data.objects.new(name, mesh)
    for collection in origin.users_collection:
        collection.objects.link(item)
    item.matrix_world = world_matrix(origin)
    count = len(mesh.vertices)
    points, velocities = (np.empty(3 * count, dtype=np.float32) for _ in range(2))
    mesh.attributes["position"].data.foreach_get("vector", points)
    mesh.attributes["velocity"].data.foreach_get("vector", velocities)
    seconds = scene.render.fps_base / scene.render.fps
    item.shape_key_add(name="Basis")
    key = item.shape_key_add(name=KEY)
    key.data.foreach_set("co", flat(points - velocities * seconds))
    key.slider_min = -1.0
    for offset in (-1, 0, 1):
        key.value = -offset
        key.keyframe_insert("value", frame=frame + offset)
    make_linear(mesh.shape_keys)
    key.value = frame - float(np.clip(scene.frame_current, frame - 1, frame + 1))
    return item


def make_linear(keys: bpy.types.Key) -> None:
    """Make the animation of shape keys linear between its frames."""
    animation = keys.animation_data
    bag = animation.action.layers[0].strips[0].channelbag(animation.action_slot)
    for curve in bag.fcurves:
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
