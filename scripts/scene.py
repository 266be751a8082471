# SPDX-License-Identifier: GPL-3.0-or-later
"""What pictures of the demo and the docs share beside the add-on's studio."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from liquid_splash_addon.blender.scene.studio import empty_material


def world_points(item: bpy.types.Object) -> np.ndarray:
    """Return the vertices of a mesh object in the world, ``(n, 3)``."""
    bpy.context.view_layer.update()
    points = np.empty((len(item.data.vertices), 3), dtype=np.float32)
    item.data.vertices.foreach_get("co", points.ravel())
    matrix = np.array(item.matrix_world)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def use_cycles(scene: bpy.types.Scene, samples: int, size: tuple[int, int]) -> None:
    """Render with Cycles on the processor, denoised, at ``size`` pixels."""
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = size
    render.resolution_percentage = 100
    cycles.device = "CPU"
    cycles.samples = samples
    cycles.use_denoising = True
    cycles.adaptive_threshold = 0.03
    cycles.max_bounces = 16
    cycles.transmission_bounces = 12
    cycles.caustics_reflective = cycles.caustics_refractive = False
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Medium High Contrast"


def add_line(points: np.ndarray, width: float, colour: Sequence[float]) -> bpy.types.Object:
    """Add a glowing line through ``points`` ``(n, 3)``: a stroke that renders everywhere."""
    curve = bpy.data.curves.new("Stroke", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", width / 2
    spline = curve.splines.new("POLY")
    spline.points.add(len(points) - 1)
    spline.points.foreach_set("co", np.insert(points, 3, 1.0, axis=1).astype(np.float32).ravel())
    material, nodes, links = empty_material("Stroke")
    light = nodes.new("ShaderNodeEmission")
    light.inputs["Color"].default_value = colour
    links.new(light.outputs["Emission"], nodes["Output"].inputs["Surface"])
    curve.materials.append(material)
    line = bpy.data.objects.new("Stroke", curve)
    bpy.context.scene.collection.objects.link(line)
    return line
