# SPDX-License-Identifier: GPL-3.0-or-later
"""A material for each liquid, shared by all splashes; lengths in it are metres at real size.

Cycles measures the way of light inside a clear liquid exactly: a ray that arrives at the surface
from inside has come that far through it. EEVEE knows only what the mesh says of its thickness.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from ...core.liquids import LIQUIDS
from ..data.look import METRES
from .material import MARK as WATER_MARK
from .material import water_material

MARK = "liquid_splash_liquid"
"""Custom property with the liquid's identifier, by which its material is found, also renamed."""

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Clear:
    """A liquid that light goes through.

    Attributes
    ----------
    colour : share of red, green and blue light left after ``depth``
    depth : metres
    ior : index of refraction
    shown : colour of the viewport's solid mode
    """

    colour: Colour
    depth: float
    ior: float
    shown: Colour


@dataclass(frozen=True)
class Cloudy:
    """A liquid that scatters light.

    Attributes
    ----------
    colour : what it reflects
    radius : of red, green and blue light's scattering, millimetres
    scatters : share of light that scatters inside
    roughness, ior : of its surface
    """

    colour: Colour
    radius: Colour
    scatters: float
    roughness: float
    ior: float


LOOKS: dict[str, Clear | Cloudy] = {
    # Merlot absorbs 116, 252 and 294 / m (Narasimhan et al. 2006).
    "WINE": Clear((0.313, 0.0805, 0.0527), 0.01, 1.345, (0.3, 0.02, 0.05)),
    "INK": Clear((2e-4, 1.5e-3, 0.11), 0.001, 1.34, (0.01, 0.02, 0.15)),
    "HONEY": Clear((0.87, 0.48, 0.035), 0.01, 1.49, (0.8, 0.4, 0.03)),
    # Whole milk scatters 2.55, 3.21 and 3.77 / mm and absorbs hardly any (Jensen et al. 2001).
    "MILK": Cloudy((0.93, 0.91, 0.84), (0.39, 0.31, 0.26), 1.0, 0.06, 1.35),
    "JUICE": Cloudy((0.95, 0.4, 0.025), (3.0, 1.2, 0.3), 1.0, 0.05, 1.35),
    "PAINT": Cloudy((0.75, 0.045, 0.02), (0.1, 0.04, 0.03), 0.2, 0.22, 1.48),
    "CHOCOLATE": Cloudy((0.115, 0.042, 0.018), (0.5, 0.25, 0.12), 0.4, 0.2, 1.46),
}
"""What the liquids look like beside water; where no source stands, chosen by eye."""


def material_of(name: str) -> bpy.types.Material:
    """Return this file's material of a liquid (a key of LIQUIDS); make it if there is none."""
    if name == "WATER":
        return water_material()
    for material in bpy.data.materials:
        if material.get(MARK) == name and material.library is None:
            return material
    material = bpy.data.materials.new(f"Splash Liquid {LIQUIDS[name].label}")
    material[MARK] = name
    if bpy.app.version < (5, 0, 0):  # always on, and deprecated, from 5.0
        material.use_nodes = True
    look = LOOKS[name]
    nodes = ShaderNodes(material.node_tree)
    if isinstance(look, Clear):
        fill_clear(nodes, look)
    else:
        fill_cloudy(nodes, look)
    material.use_raytrace_refraction = True  # EEVEE
    shown = look.shown if isinstance(look, Clear) else look.colour
    material.diffuse_color = (*shown, 1.0)  # the viewport's solid mode
    return material


def liquid_of(material: bpy.types.Material | None) -> str | None:
    """Return which liquid a material is, linked or not; None if it is none of ours."""
    if material is None:
        return None
    if WATER_MARK in material:
        return "WATER"
    found = material.get(MARK)
    return found if found in LIQUIDS else None


def needs_attributes(item: bpy.types.Object) -> bool:
    """Whether a material of an object is better with attributes of its mesh: any but water."""
    return any(liquid_of(slot.material) not in (None, "WATER") for slot in item.material_slots)


def give(item: bpy.types.Object, material: bpy.types.Material) -> None:
    """Give an object a liquid's material in place of another liquid's, else of its first one."""
    slots = [slot.material for slot in item.material_slots]
    ours = [n for n, known in enumerate(slots) if liquid_of(known) is not None]
    if not slots:
        item.data.materials.append(material)
    else:
        item.material_slots[ours[0] if ours else 0].material = material


class ShaderNodes:
    """Adds nodes to a material's tree, in a row."""

    def __init__(self, tree: bpy.types.NodeTree) -> None:
        """Take the tree, with its Principled shader and its output."""
        self.tree = tree
        self.shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
        self.output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
        self.count = 0

    def add(self, kind: str, label: str = "", **settings: Any) -> Any:
        """Add a node."""
        node = self.tree.nodes.new(kind)
        node.label = label
        for name, value in settings.items():
            setattr(node, name, value)
        node.location = (-250 - 200 * (self.count % 6), 300 - 250 * (self.count // 6))
        self.count += 1
        return node

    def feed(self, socket: Any, source: Any) -> None:
        """Set an input to a value, or link it to an output."""
        if isinstance(source, bpy.types.NodeSocket):
            self.tree.links.new(source, socket)
        else:
            socket.default_value = source

    def math(self, operation: str, *sources: Any) -> Any:
        """Add a node that calculates with numbers; return its output."""
        node = self.add("ShaderNodeMath", operation=operation)
        for socket, source in zip(node.inputs, sources, strict=False):
            self.feed(socket, source)
        return node.outputs[0]

    def attribute(self, name: str, kind: str = "GEOMETRY") -> Any:
        """Add a node that reads an attribute."""
        return self.add("ShaderNodeAttribute", attribute_name=name, attribute_type=kind)

    def metres(self) -> Any:
        """Return metres at real size per unit of the world; objects that say nothing have 1."""
        said = self.attribute(METRES, "OBJECT").outputs["Fac"]
        unsaid = self.math("LESS_THAN", said, 1e-9)
        turn = self.add(
            "ShaderNodeVectorTransform", vector_type="VECTOR", convert_from="OBJECT",
            convert_to="WORLD",
        )  # fmt: skip
        turn.inputs[0].default_value = (3**-0.5,) * 3
        length = self.add("ShaderNodeVectorMath", operation="LENGTH")
        self.feed(length.inputs[0], turn.outputs[0])
        return self.math("DIVIDE", self.math("ADD", said, unsaid), length.outputs["Value"])

    def colour(self, colour: Colour, label: str) -> Any:
        """Return a liquid's colour, or that of the stroke that tints it."""
        own = self.add("ShaderNodeRGB", label)
        own.outputs[0].default_value = (*colour, 1.0)
        tint = self.attribute("tint")
        share = self.attribute("tinted")  # an attribute that is missing has alpha 1
        mix = self.add("ShaderNodeMix", data_type="RGBA")
        self.feed(mix.inputs[0], share.outputs["Fac"])
        self.feed(mix.inputs[6], own.outputs[0])
        self.feed(mix.inputs[7], tint.outputs["Color"])
        return mix.outputs[2]

    def power(self, colour: Any, exponent: Any) -> Any:
        """Return a colour to the power of a number."""
        node = self.add("ShaderNodeGamma")
        self.feed(node.inputs[0], colour)
        self.feed(node.inputs[1], exponent)
        return node.outputs[0]


def fill_clear(nodes: ShaderNodes, look: Clear) -> None:
    """Absorb light by Beer's law: by ``colour`` for every ``depth`` of its way.

    For Cycles a glass with an output of its own: reflection inside is coloured with it, as the
    Principled shader's is not. For EEVEE, and for exporters, the Principled shader.
    """
    shader, output = nodes.shader, nodes.output
    colour = nodes.colour(look.colour, "Color at Depth")
    depth = nodes.add("ShaderNodeValue", "Depth (m)").outputs[0]
    depth.default_value = look.depth
    metres = nodes.metres()
    inside = nodes.add("ShaderNodeNewGeometry").outputs["Backfacing"]
    way = nodes.math("MULTIPLY", nodes.add("ShaderNodeLightPath").outputs["Ray Length"], metres)
    way = nodes.math("MULTIPLY", way, inside)
    glass = nodes.add("ShaderNodeBsdfGlass")
    glass.inputs["IOR"].default_value = look.ior
    glass.inputs["Roughness"].default_value = 0.0
    left = nodes.power(colour, nodes.math("DIVIDE", way, depth))
    nodes.feed(glass.inputs["Color"], left)
    exact = nodes.add("ShaderNodeOutputMaterial", "Cycles", target="CYCLES")
    nodes.feed(exact.inputs["Surface"], glass.outputs[0])
    output.is_active_output = True
    thickness = nodes.attribute("thickness").outputs["Fac"]
    # The shader takes the root of its colour both where light goes in and where it comes out.
    nodes.feed(
        shader.inputs["Base Color"], nodes.power(colour, nodes.math("DIVIDE", thickness, depth))
    )
    for name, value in (("Roughness", 0.0), ("IOR", look.ior), ("Transmission Weight", 1.0)):
        shader.inputs[name].default_value = value
    nodes.feed(output.inputs["Thickness"], nodes.math("DIVIDE", thickness, metres))


def fill_cloudy(nodes: ShaderNodes, look: Cloudy) -> None:
    """Scatter light by the Principled shader, in Cycles and EEVEE, over millimetres."""
    shader = nodes.shader
    nodes.feed(shader.inputs["Base Color"], nodes.colour(look.colour, "Color"))
    for name, value in (
        ("Roughness", look.roughness), ("IOR", look.ior), ("Subsurface Weight", look.scatters),
        ("Subsurface Radius", look.radius),
    ):  # fmt: skip
        shader.inputs[name].default_value = value
    millimetre = nodes.math("DIVIDE", 0.001, nodes.metres())
    nodes.feed(shader.inputs["Subsurface Scale"], millimetre)
