# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ...core.refinement.presets import STARTS
from ...core.settings import SplashSettings

ADDON = __package__.removesuffix(".blender.data")
"""Name of the add-on's package, by which Blender knows it."""

START_ITEMS = tuple((name, preset.label, preset.about) for name, preset in STARTS.items())
"""What new splashes can start with, as Blender lists it."""

SECTIONS: list[Callable[[Any, bpy.types.Context], None]] = []
"""What else draws into the preferences: the room ``ui`` adds itself, as it may use all others."""


def device_items() -> tuple[tuple[str, str, str], ...]:
    """Return the devices that a splash can be made on, as the settings name them."""
    (device,) = (item for item in fields(SplashSettings) if item.name == "device")
    return tuple(device.metadata["items"])


class SPLASH_AP_preferences(bpy.types.AddonPreferences):
    """Which trained network makes splashes, on which device and in which number format it runs."""

    bl_idname = ADDON

    weights_path: StringProperty(
        name="Network",
        description="File of the trained network that makes splashes. Empty: the one that comes "
        "with the add-on",
        subtype="FILE_PATH",
    )

    device: EnumProperty(
        name="Device",
        description="What Automatic means in the settings of splashes",
        items=device_items(),
        default="AUTO",
    )

    precision: EnumProperty(
        name="Precision",
        description="Number format for new splashes. A splash keeps the one that it was made in",
        items=(
            ("AUTO", "Fastest", "Measure once which format is the fastest on this machine"),
            ("float32", "Full", "32 bits: the same result everywhere, slower on some machines"),
            ("bfloat16", "Half", "16 bits: fast on some machines, slow on others"),
            (
                "int8",
                "Eight Bits",
                "8 bits for most of the work, 32 for the rest. CPU only",
            ),
            (
                "int8_bfloat16",
                "Eight and Sixteen Bits",
                "8 bits for most of the work, 16 for the rest. For CPUs that are fast at both",
            ),
        ),
        default="AUTO",
    )

    start: EnumProperty(
        name="Start With",
        description="The refinements that new splashes begin with, in scenes that do not say "
        "otherwise",
        items=START_ITEMS,
    )

    show_hints: BoolProperty(
        name="Hints",
        description="Say in the viewport what to do next, until the first splash exists",
        default=True,
    )

    measured: StringProperty(
        name="Measured",
        description="Fastest number format of each device, as measured on this machine (JSON)",
        options={"HIDDEN"},
    )

    tested: StringProperty(
        name="Tested",
        description="What the last test of the device found",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    def draw(self, context: bpy.types.Context) -> None:
        """Show the preferences."""
        column = self.layout.column()
        column.use_property_split = True
        column.prop(self, "weights_path")
        column.prop(self, "device")
        column.prop(self, "precision")
        column.prop(self, "start")
        column.prop(self, "show_hints")
        for section in SECTIONS:
            section(self.layout, context)


def own_preferences(context: bpy.types.Context) -> Any:
    """Return the add-on's preferences; None where it was registered by hand, as in tests."""
    entry = context.preferences.addons.get(ADDON)
    return entry.preferences if entry else None


def weights_path(context: bpy.types.Context) -> Path | None:
    """Return the weights file that the user chose; None for the one that comes with the add-on."""
    preferences = own_preferences(context)
    chosen = preferences.weights_path if preferences else ""
    return Path(bpy.path.abspath(chosen)) if chosen else None


def device_for(context: bpy.types.Context, setting: str) -> str:
    """Return the device for a splash whose setting is this one: Automatic is for us to say."""
    preferences = own_preferences(context)
    return str(preferences.device) if preferences and setting == "AUTO" else setting


def known_precision(context: bpy.types.Context, device: str) -> str:
    """Return the number format for new splashes on ``device``; "" if it is still to be measured."""
    preferences = own_preferences(context)
    if not preferences:
        return ""
    if preferences.precision != "AUTO":
        return str(preferences.precision)
    return measured(preferences).get(device, "")


def keep_precision(context: bpy.types.Context, device: str, precision: str) -> None:
    """Remember which number format was measured to be the fastest on ``device``."""
    preferences = own_preferences(context)
    if preferences:
        preferences.measured = json.dumps({**measured(preferences), device: precision})


def measured(preferences: Any) -> dict[str, str]:
    """Read the formats that :func:`keep_precision` wrote; none if the text was damaged."""
    try:
        notes = json.loads(preferences.measured or "{}")
    except ValueError:
        return {}
    return notes if isinstance(notes, dict) else {}


register, unregister = bpy.utils.register_classes_factory((SPLASH_AP_preferences,))
