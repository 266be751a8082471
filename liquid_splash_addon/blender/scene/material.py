# SPDX-License-Identifier: GPL-3.0-or-later
"""The water material that all splashes share."""

from __future__ import annotations

import bpy

NAME = "Splash Water"
MARK = "liquid_splash_water"
"""Custom property by which the material is found, also when it was renamed or edited."""

WATER = {
    "Base Color": (1.0, 1.0, 1.0, 1.0),
    "Roughness": 0.0,
    "IOR": 1.333,
    "Transmission Weight": 1.0,
}
"""Inputs of the Principled shader, by name: their order differs between Blender's versions."""


def water_material() -> bpy.types.Material:
    """Return the water material of this file; make it if there is none."""
    for material in bpy.data.materials:
        if MARK in material and material.library is None:
            return material
    material = bpy.data.materials.new(NAME)
    material[MARK] = True
    if bpy.app.version < (5, 0, 0):  # always on, and deprecated, from 5.0
        material.use_nodes = True
    shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    for name, value in WATER.items():
        shader.inputs[name].default_value = value
    material.use_raytrace_refraction = True  # EEVEE
    see_as_films(material.node_tree)
    material.diffuse_color = (0.45, 0.7, 0.85, 1.0)  # the viewport's solid mode
    return material


def see_as_films(tree: bpy.types.NodeTree) -> None:
    """Have EEVEE let light straight through: it would take the whole splash for one glass ball."""
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    thin = tree.nodes.new("ShaderNodeValue")
    thin.label = "Thickness in EEVEE"
    thin.location = output.location.x - 180, output.location.y - 220
    thin.outputs[0].default_value = 0.0
    tree.links.new(thin.outputs[0], output.inputs["Thickness"])
