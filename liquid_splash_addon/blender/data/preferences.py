# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import bpy
from bpy.props import EnumProperty, StringProperty

ADDON = __package__.removesuffix(".blender.data")
"""Name of the add-on's package, by which Blender knows it."""


class SPLASH_AP_preferences(bpy.types.AddonPreferences):
    """Where the generator comes from."""

    bl_idname = ADDON

    weights_path: StringProperty(
        name="Weights",
        description="Weights file of the generator; empty: the one that comes with the add-on",
        subtype="FILE_PATH",
    )

    precision: EnumProperty(
        name="Precision",
        description="Number format in which new splashes are computed; a splash keeps its own",
        items=(
            ("AUTO", "Fastest", "Measure once which is fastest on this machine"),
            ("float32", "Full", "32 bits: the same everywhere, slower on some machines"),
            ("bfloat16", "Half", "16 bits: fast on some machines, slow on others"),
            ("int8", "Eight Bits", "8 bits for most of the work, 32 for the rest: on processors"),
            (
                "int8_bfloat16",
                "Eight and Sixteen Bits",
                "8 bits for most of the work, 16 for the rest: on processors that are fast in both",
            ),
        ),
        default="AUTO",
    )

    measured: StringProperty(
        name="Measured",
        description="Fastest number format of each device, as found on this machine (JSON)",
        options={"HIDDEN"},
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Show the preferences."""
        self.layout.use_property_split = True
        self.layout.prop(self, "weights_path")
        self.layout.prop(self, "precision")


def own(context: bpy.types.Context) -> Any:
    """Return the add-on's preferences; None where it was registered by hand, as tests do."""
    entry = context.preferences.addons.get(ADDON)
    return entry.preferences if entry else None


def weights_path(context: bpy.types.Context) -> Path | None:
    """Return the weights file that the user chose, None for the bundled one."""
    mine = own(context)
    chosen = mine.weights_path if mine else ""
    return Path(bpy.path.abspath(chosen)) if chosen else None


def known_precision(context: bpy.types.Context, device: str) -> str:
    """Return the number format for new splashes on ``device``; empty: not measured yet."""
    mine = own(context)
    if not mine:
        return ""
    return mine.precision if mine.precision != "AUTO" else measured(mine).get(device, "")


def keep_precision(context: bpy.types.Context, device: str, precision: str) -> None:
    """Note which number format was measured to be the fastest on ``device``."""
    mine = own(context)
    if mine:
        mine.measured = json.dumps({**measured(mine), device: precision})


def measured(mine: Any) -> dict[str, str]:
    """Return the notes of :func:`keep_precision`; none if they were edited to nonsense."""
    try:
        notes = json.loads(mine.measured or "{}")
    except ValueError:
        return {}
    return notes if isinstance(notes, dict) else {}


register, unregister = bpy.utils.register_classes_factory((SPLASH_AP_preferences,))
