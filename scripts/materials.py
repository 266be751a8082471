# SPDX-License-Identifier: GPL-3.0-or-later
"""The liquids of the pictures: inputs of the splash's material that make it another than water."""

from __future__ import annotations

from typing import Any

import bpy

OPAQUE = {"Transmission Weight": 0.0, "Subsurface Weight": 0.2, "Subsurface Scale": 0.05}

LIQUIDS: dict[str, dict[str, Any]] = {
    "water": {},
    "ink": {"Base Color": (0.12, 0.42, 1.0, 1.0)},
    "wine": {"Base Color": (0.85, 0.08, 0.12, 1.0)},
    "rose": {"Base Color": (1.0, 0.6, 0.5, 1.0)},
    "juice": {"Base Color": (1.0, 0.55, 0.12, 1.0)},
    "milk": {"Base Color": (0.8, 0.78, 0.74, 1.0), "Roughness": 0.18, **OPAQUE},
    "chocolate": {"Base Color": (0.11, 0.045, 0.02, 1.0), "Roughness": 0.22, **OPAQUE},
    "paint": {"Base Color": (0.75, 0.05, 0.12, 1.0), "Roughness": 0.2, **OPAQUE},
    "clay": {
        "Base Color": (0.35, 0.5, 0.62, 1.0), "Roughness": 0.35, "Transmission Weight": 0.0,
    },
}  # fmt: skip
"""By name. Clay is none: it hides nothing of the shape."""


def pour(item: bpy.types.Object | bpy.types.Material, liquid: str) -> None:
    """Make a material, or that of a splash, that liquid: for all splashes that share it."""
    material = item if isinstance(item, bpy.types.Material) else item.data.materials[0]
    nodes = material.node_tree.nodes
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    for name, value in LIQUIDS[liquid].items():
        shader.inputs[name].default_value = value
