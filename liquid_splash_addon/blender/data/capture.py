# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene remembers of drawing with tracked hands."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, PointerProperty

from ...core.sketch.recording import RecordingSettings
from .properties import settings_properties


class SplashCaptureGroup(bpy.types.PropertyGroup):
    """How hands draw, and whose buttons the panel shows."""

    __annotations__ = settings_properties(RecordingSettings)
    __annotations__["controller"] = EnumProperty(
        name="Controller",
        description="Controller whose buttons are listed here. All of them work at any time",
        items=(
            ("TOUCH", "Meta Touch", "Quest and Rift"),
            ("INDEX", "Valve Index", "Knuckles"),
            ("VIVE", "HTC Vive", "Wands"),
            ("WMR", "Windows Mixed Reality", "Motion controllers"),
            ("SIMPLE", "Other", "Controllers of which only a trigger and a menu button are known"),
        ),
    )


register_classes, unregister_classes = bpy.utils.register_classes_factory((SplashCaptureGroup,))


def register() -> None:
    """Add ``Scene.splash_capture``."""
    register_classes()
    bpy.types.Scene.splash_capture = PointerProperty(type=SplashCaptureGroup)


def unregister() -> None:
    """Remove ``Scene.splash_capture``."""
    del bpy.types.Scene.splash_capture
    unregister_classes()
