# SPDX-License-Identifier: GPL-3.0-or-later
"""A photographer's table for water, its lights and its camera: for the demo and docs' pictures.

Water shows nothing of its own, only what is behind and around it. So: a table that glows behind
it and falls off to dark (the water's edges bend in the dark and get their outline) and mirrors
it below, and long strip lights at the sides (highlights that run along the sheets).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

DEEP = (0.006, 0.016, 0.035, 1.0)
BLUE = ((0.22, 0.62, 1.0, 1.0), (0.05, 0.2, 0.4, 1.0))
WARM = ((1.0, 0.86, 0.72, 1.0), (0.5, 0.24, 0.14, 1.0))
"""Colours of the glow in its middle and halfway to the dark."""

GLOW_STRENGTH = 1.2
GLOW_RADIUS = 1.7
"""Where the glow ends, in radii of the subject."""


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


def add_camera(scene: bpy.types.Scene, points: np.ndarray, view: Vector, lens: float) -> Any:
    """Add the scene's camera, looking along ``view`` and just holding ``points`` ``(n, 3)``."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = lens
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.rotation_euler = view.to_track_quat("-Z", "Y").to_euler()
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    camera.location, _ = camera.camera_fit_coords(graph, points.ravel().tolist())
    bpy.context.view_layer.update()
    return camera


def widened(points: np.ndarray, margin: float) -> np.ndarray:
    """Return ``points`` moved away from their box's centre by a share ``margin``."""
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return centre + (points - centre) * (1 + margin)


def add_light(
    name: str, place: Vector, target: Vector, size: tuple[float, float], power: float, colour: Any
) -> bpy.types.Object:
    """Add a rectangular area light at ``place`` that shines on ``target``."""
    data = bpy.data.lights.new(name, "AREA")
    data.shape, (data.size, data.size_y) = "RECTANGLE", size
    data.energy, data.color = power, colour
    light = bpy.data.objects.new(name, data)
    light.location = place
    light.rotation_euler = (target - place).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(light)
    return light


def add_lights(centre: Vector, radius: float, view: Vector) -> None:
    """Add the strip lights around a subject of ``radius``; ``view`` is where the camera looks.

    Powers are for a radius of one: light falls off with the square of the distance.
    """
    side = view.cross(Vector((0, 0, 1))).normalized()
    up = Vector((0, 0, 1))
    watt = radius**2
    strip = (0.5 * radius, 4 * radius)
    for name, place, size, power, colour in (
        ("Left strip", -3 * side + 0.6 * view + 0.8 * up, strip, 160, (0.8, 0.93, 1.0)),
        ("Right strip", 3 * side + 1.2 * view + 1.0 * up, strip, 220, (1.0, 0.96, 0.9)),
        ("Top", 0.5 * view + 3.2 * up, (2.5 * radius, 1.2 * radius), 130, (0.9, 0.97, 1.0)),
        ("Front", -2.5 * view + 2.0 * up - side, (radius, radius), 25, (1.0, 1.0, 1.0)),
    ):
        add_light(name, centre + radius * place, centre, size, power * watt, colour)


def add_table(
    centre: Vector, low: float, radius: float, view: Vector, glow: Sequence[Any] = BLUE
) -> bpy.types.Object:
    """Add a mirroring table at the height ``low``, lit from within behind the subject."""
    bpy.ops.mesh.primitive_plane_add(size=200 * radius)
    table = bpy.context.active_object
    table.name = "Table"
    # The glow is a circle to the camera, so on the table a long ellipse along the view.
    steep = max(-view.z, 0.05)
    table.location = centre + view * ((centre.z - low) / steep + 0.5 * radius / steep)
    table.location.z = low
    table.rotation_euler.z = np.arctan2(-view.x, view.y)
    reach = GLOW_RADIUS * radius
    table.data.materials.append(table_material((reach, reach / steep), glow))
    set_world(DEEP)
    return table


def set_world(colour: Sequence[float]) -> None:
    """Surround the scene with one colour."""
    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = colour


def table_material(reach: tuple[float, float], glow: Sequence[Any]) -> bpy.types.Material:
    """Return a dark, glossy material that glows in the middle and fades over ``reach`` (x, y)."""
    material, nodes, links = empty_material("Table")
    material.cycles.emission_sampling = "NONE"  # too large to be worth aiming at
    place = nodes.new("ShaderNodeTexCoord")
    share = nodes.new("ShaderNodeVectorMath")
    share.operation = "DIVIDE"
    share.inputs[1].default_value = (*reach, 1.0)
    distance = nodes.new("ShaderNodeVectorMath")
    distance.operation = "LENGTH"
    ramp = nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.interpolation = "EASE"
    ramp.color_ramp.elements[0].color = glow[0]
    ramp.color_ramp.elements[1].color = DEEP
    ramp.color_ramp.elements.new(0.5).color = glow[1]
    shader = nodes.new("ShaderNodeBsdfPrincipled")
    shader.inputs["Base Color"].default_value = (0.004, 0.012, 0.02, 1.0)
    shader.inputs["Roughness"].default_value = 0.06
    shader.inputs["Emission Strength"].default_value = GLOW_STRENGTH
    links.new(place.outputs["Object"], share.inputs[0])
    links.new(share.outputs["Vector"], distance.inputs[0])
    links.new(distance.outputs["Value"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], shader.inputs["Emission Color"])
    links.new(shader.outputs["BSDF"], nodes["Output"].inputs["Surface"])
    return material


def empty_material(name: str) -> tuple[bpy.types.Material, Any, Any]:
    """Return a material with nothing but an output node, its nodes and its links."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    tree.nodes.new("ShaderNodeOutputMaterial").name = "Output"
    return material, tree.nodes, tree.links


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
