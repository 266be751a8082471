# SPDX-License-Identifier: GPL-3.0-or-later
"""A dancer, for liquid to flow around: an ordinary mesh object, from a skeleton and modifiers."""

from __future__ import annotations

from itertools import pairwise

import bpy

from liquid_splash_addon.blender.scene import studio

JOINTS = {
    "hip": ((0.0, 0.0, -0.05), 0.26),
    "waist": ((0.02, 0.0, 0.32), 0.19),
    "chest": ((0.0, 0.0, 0.72), 0.25),
    "neck": ((0.0, 0.0, 1.06), 0.085),
    "chin": ((-0.02, 0.0, 1.22), 0.13),
    "crown": ((-0.03, 0.0, 1.44), 0.15),
    "knee": ((0.02, 0.06, -1.0), 0.13),
    "ankle": ((-0.02, 0.02, -1.8), 0.07),
    "toes": ((-0.02, -0.04, -2.1), 0.04),
    "raised knee": ((0.58, -0.5, -0.42), 0.15),
    "raised ankle": ((0.52, -0.2, -1.12), 0.075),
    "raised toes": ((0.42, -0.12, -1.42), 0.04),
    "left shoulder": ((-0.32, 0.0, 0.88), 0.1),
    "left elbow": ((-0.72, -0.05, 1.18), 0.075),
    "left hand": ((-0.42, -0.12, 1.66), 0.04),
    "right shoulder": ((0.32, 0.0, 0.88), 0.1),
    "right elbow": ((0.85, -0.12, 0.8), 0.075),
    "right hand": ((1.35, -0.25, 0.95), 0.04),
}
"""Places of the joints and radii of the body there. The hips are near the origin, z is up."""

LIMBS = (
    ("hip", "waist", "chest", "neck", "chin", "crown"),
    ("hip", "knee", "ankle", "toes"),
    ("hip", "raised knee", "raised ankle", "raised toes"),
    ("chest", "left shoulder", "left elbow", "left hand"),
    ("chest", "right shoulder", "right elbow", "right hand"),
)

BRASS = {"Base Color": (0.62, 0.36, 0.15, 1.0), "Metallic": 1.0, "Roughness": 0.38}
"""Inputs of the Principled shader."""


def add_dancer(collection: bpy.types.Collection) -> bpy.types.Object:
    """Add the dancer to ``collection`` and return it."""
    names = list(JOINTS)
    bones = [(names.index(a), names.index(b)) for limb in LIMBS for a, b in pairwise(limb)]
    mesh = bpy.data.meshes.new("Dancer")
    mesh.from_pydata([place for place, _ in JOINTS.values()], bones, [])
    mesh.materials.append(brass())
    dancer = bpy.data.objects.new("Dancer", mesh)
    collection.objects.link(dancer)
    add_flesh(dancer)
    return dancer


def add_flesh(dancer: bpy.types.Object) -> None:
    """Turn the skeleton into a closed, smooth body, by modifiers."""
    dancer.modifiers.new("Skin", "SKIN")  # this makes the layer of radii, too
    radii = dancer.data.skin_vertices[0].data
    for vertex, (_, radius) in zip(radii, JOINTS.values(), strict=True):
        vertex.radius = radius, radius
    rounded = dancer.modifiers.new("Subdivision", "SUBSURF")
    rounded.levels = rounded.render_levels = 2
    # Skins cross themselves where limbs meet; the surface around their volume does not.
    closed = dancer.modifiers.new("Remesh", "REMESH")
    closed.mode, closed.voxel_size, closed.use_smooth_shade = "VOXEL", 0.03, True
    smooth = dancer.modifiers.new("Smooth", "SMOOTH")
    smooth.factor, smooth.iterations = 0.5, 8


def brass() -> bpy.types.Material:
    """Return a brushed metal."""
    material, nodes, links = studio.empty_material("Brass")
    shader = nodes.new("ShaderNodeBsdfPrincipled")
    for name, value in BRASS.items():
        shader.inputs[name].default_value = value
    links.new(shader.outputs["BSDF"], nodes["Output"].inputs["Surface"])
    return material
