# SPDX-License-Identifier: GPL-3.0-or-later
"""A bottle and a tumbler, closed meshes: for liquid to flow around and out of."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from liquid_splash_addon.blender.scene import studio

SIDES = 64

BOTTLE = [
    (0.0, 0.0), (0.46, 0.0), (0.5, 0.02), (0.5, 0.55), (0.47, 0.63), (0.36, 0.7), (0.22, 0.76),
    (0.17, 0.82), (0.17, 0.95), (0.2, 0.955), (0.2, 0.995), (0.16, 1.0), (0.0, 1.0),
]  # fmt: skip
TUMBLER = [
    (0.0, 0.0), (0.38, 0.0), (0.41, 0.03), (0.5, 1.0), (0.465, 1.0), (0.37, 0.12), (0.0, 0.1),
]  # fmt: skip
"""Profiles: radius over the diameter, height over the whole."""


def add_bottle(
    collection: bpy.types.Collection, diameter: float, height: float, place: Sequence[float]
) -> bpy.types.Object:
    """Add a dark bottle that stands at ``place``."""
    profile = np.array(BOTTLE) * [diameter, height]
    return add_turned(collection, "Bottle", profile, place, (0.01, 0.05, 0.03, 1.0), 0.0)


def add_tumbler(
    collection: bpy.types.Collection, diameter: float, height: float, place: Sequence[float],
    lean: float,
) -> bpy.types.Object:  # fmt: skip
    """Add a glass at ``place`` that leans towards +x by an angle."""
    profile = np.array(TUMBLER) * [diameter, height]
    glass = add_turned(collection, "Tumbler", profile, place, (1.0, 1.0, 1.0, 1.0), 1.0)
    glass.rotation_euler.y = lean
    return glass


def add_turned(
    collection: bpy.types.Collection, name: str, profile: np.ndarray, place: Sequence[float],
    colour: Sequence[float], clear: float,
) -> bpy.types.Object:  # fmt: skip
    """Add what a lathe makes of a profile ``(n, 2)`` that begins and ends on the axis."""
    angles = 2 * np.pi * np.arange(SIDES) / SIDES
    inner = profile[1:-1]
    rings = [(r * np.cos(a), r * np.sin(a), z) for r, z in inner for a in angles]
    points = [(0.0, 0.0, profile[0, 1]), (0.0, 0.0, profile[-1, 1]), *rings]

    def corner(ring: int, side: int) -> int:
        return 2 + ring * SIDES + side % SIDES

    faces = [(0, corner(0, n + 1), corner(0, n)) for n in range(SIDES)]
    last = len(inner) - 1
    faces += [(1, corner(last, n), corner(last, n + 1)) for n in range(SIDES)]
    faces += [
        (corner(ring, n), corner(ring, n + 1), corner(ring + 1, n + 1), corner(ring + 1, n))
        for ring in range(last)
        for n in range(SIDES)
    ]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    mesh.shade_smooth()
    mesh.materials.append(glass(name, colour, clear))
    item = bpy.data.objects.new(name, mesh)
    item.location = place
    collection.objects.link(item)
    return item


def glass(name: str, colour: Sequence[float], clear: float) -> bpy.types.Material:
    """Return glass of a colour; clear : share of the light that goes through."""
    material, nodes, links = studio.empty_material(name)
    shader = nodes.new("ShaderNodeBsdfPrincipled")
    shader.inputs["Base Color"].default_value = colour
    shader.inputs["Roughness"].default_value = 0.03
    shader.inputs["Transmission Weight"].default_value = clear
    links.new(shader.outputs["BSDF"], nodes["Output"].inputs["Surface"])
    return material
