# SPDX-License-Identifier: GPL-3.0-or-later
"""A photographer's table for liquid: what glows and what shines around it, and a camera.

Water shows nothing of its own, only what is behind and around it. So: a table that glows behind
it and falls off to dark (the water's edges bend in the dark and get their outline) and mirrors
it below, and long strip lights at the sides (highlights that run along the sheets).

All lengths are units of the world; ``view`` is the unit vector along which the camera looks.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

MARK = "liquid_splash_studio"
"""Custom property of the studio's collection and world, by which they are found again."""

CAMERA_BEFORE = "camera before"
"""Custom property of the collection: the camera that the scene had before the studio's."""

NAME = "Splash Studio"

DEEP = (0.006, 0.016, 0.035, 1.0)
BLUE = ((0.22, 0.62, 1.0, 1.0), (0.05, 0.2, 0.4, 1.0))
WARM = ((1.0, 0.86, 0.72, 1.0), (0.5, 0.24, 0.14, 1.0))
"""Colours of the glow in its middle and halfway to the dark."""

GLOWS = {"BLUE": BLUE, "WARM": WARM}

GLOW_STRENGTH = 1.2
GLOW_RADIUS = 1.7
"""Where the glow ends, in radii of the subject."""

SUNK = 0.02
"""Share of the subject's radius that the table lies above its lowest point: liquid touches it."""

MARGIN = 0.15
"""Share of the subject's size that the camera leaves free at each side."""

LENS = 70.0
"""Focal length of the studio's camera, millimetres."""


def studio_in(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    """Return the collection of a scene's studio, if it has one."""
    return next((item for item in scene.collection.children if MARK in item), None)


def build(
    scene: bpy.types.Scene,
    points: np.ndarray,
    view: Vector,
    glow: Sequence[Any] = BLUE,
    margin: float | None = MARGIN,
) -> bpy.types.Collection:
    """Build a studio around ``points`` ``(n, 3)`` in place of the scene's old one.

    The world that the scene had stays in the file. EEVEE's ray tracing is switched on: without,
    clear liquid is black in it.

    glow : its colours, see GLOWS; margin : see MARGIN, None for no camera
    """
    before = clear(scene)
    studio = bpy.data.collections.new(NAME)
    studio[MARK] = True
    if before is not None:
        studio[CAMERA_BEFORE] = before
    scene.collection.children.link(studio)
    low, high = Vector(points.min(axis=0)), Vector(points.max(axis=0))
    centre, radius = (low + high) / 2, max((high - low).length / 2, 1e-6)
    add_table(studio, centre, low.z + SUNK * radius, radius, view, glow)
    add_lights(studio, centre, radius, view)
    if scene.world is not None and MARK not in scene.world and scene.world.is_editable:
        scene.world.use_fake_user = True  # else nothing keeps it when the file is saved
    scene.world = world_of(DEEP)
    scene.eevee.use_raytracing = True
    if margin is not None:
        add_camera(scene, studio, widened(points, margin), view, LENS)
    return studio


def clear(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Take away the studio that a scene has; return the camera that it has without."""
    studio = studio_in(scene)
    if studio is None:
        return scene.camera
    if scene.camera is not None and scene.camera.name in studio.objects:
        scene.camera = studio.get(CAMERA_BEFORE)
    before = scene.camera
    own = [item for item in studio.objects if item.users_collection == (studio,)]
    data = {item.data for item in own} | {slot.material for o in own for slot in o.material_slots}
    for item in own:
        bpy.data.objects.remove(item)
    bpy.data.collections.remove(studio)
    for block in sorted(filter(None, data), key=lambda block: block.id_type == "MATERIAL"):
        if not block.users:  # meshes first: they use the material
            bpy.data.batch_remove([block])
    return before


def widened(points: np.ndarray, margin: float) -> np.ndarray:
    """Return ``points`` moved away from their box's centre by a share ``margin``."""
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return np.asarray(centre + (points - centre) * (1 + margin))


def add_camera(
    scene: bpy.types.Scene,
    collection: bpy.types.Collection,
    points: np.ndarray,
    view: Vector,
    lens: float,
) -> bpy.types.Object:
    """Add the scene's camera, looking along ``view`` and just holding ``points`` ``(n, 3)``."""
    camera = bpy.data.objects.new("Studio Camera", bpy.data.cameras.new("Studio Camera"))
    camera.data.lens = lens
    collection.objects.link(camera)
    scene.camera = camera
    camera.rotation_euler = view.to_track_quat("-Z", "Y").to_euler()
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    camera.location, _ = camera.camera_fit_coords(graph, points.ravel().tolist())
    far = np.linalg.norm(points - np.array(camera.location), axis=1).max()
    away = max(float(far), 1e-6)
    camera.data.clip_start, camera.data.clip_end = away / 1e4, away * 1e3
    bpy.context.view_layer.update()
    return camera


def add_light(
    collection: bpy.types.Collection,
    name: str,
    place: Vector,
    target: Vector,
    size: tuple[float, float],
    power: float,
    colour: Sequence[float],
) -> bpy.types.Object:
    """Add a rectangular area light at ``place`` that shines on ``target``; power in watts."""
    data = bpy.data.lights.new(name, "AREA")
    data.shape, (data.size, data.size_y) = "RECTANGLE", size
    data.energy, data.color = power, colour
    light = bpy.data.objects.new(name, data)
    light.location = place
    light.rotation_euler = (target - place).to_track_quat("-Z", "Y").to_euler()
    collection.objects.link(light)
    return light


def add_lights(
    collection: bpy.types.Collection, centre: Vector, radius: float, view: Vector
) -> None:
    """Add the strip lights around a subject of ``radius``.

    Powers are for a radius of one: light falls off with the square of the distance.
    """
    side = view.cross(Vector((0, 0, 1)))
    side = side.normalized() if side.length > 1e-6 else Vector((1, 0, 0))
    up = Vector((0, 0, 1))
    watt = radius**2
    strip = (0.5 * radius, 4 * radius)
    for name, place, size, power, colour in (
        ("Left strip", -3 * side + 0.6 * view + 0.8 * up, strip, 160, (0.8, 0.93, 1.0)),
        ("Right strip", 3 * side + 1.2 * view + 1.0 * up, strip, 220, (1.0, 0.96, 0.9)),
        ("Top", 0.5 * view + 3.2 * up, (2.5 * radius, 1.2 * radius), 130, (0.9, 0.97, 1.0)),
        ("Front", -2.5 * view + 2.0 * up - side, (radius, radius), 25, (1.0, 1.0, 1.0)),
    ):
        place = centre + radius * place
        add_light(collection, name, place, centre, size, power * watt, colour)


def add_table(
    collection: bpy.types.Collection,
    centre: Vector,
    low: float,
    radius: float,
    view: Vector,
    glow: Sequence[Any] = BLUE,
) -> bpy.types.Object:
    """Add a mirroring table at the height ``low``, lit from within behind the subject."""
    data = bpy.data.meshes.new("Table")
    reach = 100 * radius
    square = [(-reach, -reach, 0), (reach, -reach, 0), (reach, reach, 0), (-reach, reach, 0)]
    data.from_pydata(square, [], [(0, 1, 2, 3)])
    table = bpy.data.objects.new("Table", data)
    collection.objects.link(table)
    # The glow is a circle to the camera, so on the table a long ellipse along the view.
    steep = max(-view.z, 0.05)
    table.location = centre + view * ((centre.z - low) / steep + 0.5 * radius / steep)
    table.location.z = low
    table.rotation_euler.z = np.arctan2(-view.x, view.y)
    reach = GLOW_RADIUS * radius
    data.materials.append(table_material((reach, reach / steep), glow))
    return table


def world_of(colour: Sequence[float]) -> bpy.types.World:
    """Return the studio's world, of one colour; make it if the file has none."""
    world = next((item for item in bpy.data.worlds if MARK in item and not item.library), None)
    if world is None:
        world = bpy.data.worlds.new(NAME)
        world[MARK] = True
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    background = next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = colour
    return world


def table_material(reach: tuple[float, float], glow: Sequence[Any]) -> bpy.types.Material:
    """Return a dark, glossy material that glows in the middle and fades over ``reach`` (x, y)."""
    material, nodes, links = empty_material("Table")
    if hasattr(material, "cycles"):
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
