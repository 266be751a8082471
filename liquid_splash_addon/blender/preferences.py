# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import StringProperty

from .. import __package__ as base_package


class SPLASH_AP_preferences(bpy.types.AddonPreferences):
    """Where the generator comes from."""

    bl_idname = base_package

    weights_path: StringProperty(
        name="Weights",
        description="Weights file of the generator; empty: the one that comes with the add-on",
        subtype="FILE_PATH",
    )

    def draw(self, _context: bpy.types.Context) -> None:
        """Show the preferences."""
        self.layout.use_property_split = True
        self.layout.prop(self, "weights_path")


def weights_path(context: bpy.types.Context) -> Path | None:
    """Return the weights file that the user chose, None for the bundled one."""
    # Without an entry the add-on was registered by hand, as tests and scripts do.
    entry: Any = context.preferences.addons.get(base_package)
    chosen = entry.preferences.weights_path if entry and entry.preferences else ""
    return Path(bpy.path.abspath(chosen)) if chosen else None


register, unregister = bpy.utils.register_classes_factory((SPLASH_AP_preferences,))
