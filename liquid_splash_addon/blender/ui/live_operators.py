# SPDX-License-Identifier: GPL-3.0-or-later
"""Esc stops the splash that follows the hand."""

from __future__ import annotations

from typing import Any

import bpy

from ..jobs import live

KEYMAP = "3D View"


class SPLASH_OT_stop_following(bpy.types.Operator):
    """Stop the splash that is being made. The next change of strokes or settings begins anew"""

    bl_idname = "splash.stop_following"
    bl_label = "Stop Making the Splash"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether one is being made: else Esc is what it always is."""
        return bool(context.scene.splash.live) and live.is_making()

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Stop it."""
        live.stop()
        return {"FINISHED"}


register_classes, unregister_classes = bpy.utils.register_classes_factory(
    (SPLASH_OT_stop_following,)
)

_keys: list[tuple[Any, Any]] = []


def register() -> None:
    """Register the operator, and its key; there are no keys in the background."""
    register_classes()
    keyconfig = bpy.context.window_manager.keyconfigs.addon
    if keyconfig is not None:
        keymap = keyconfig.keymaps.new(KEYMAP, space_type="VIEW_3D")
        item = keymap.keymap_items.new(SPLASH_OT_stop_following.bl_idname, "ESC", "PRESS")
        _keys.append((keymap, item))


def unregister() -> None:
    """Take both away."""
    for keymap, item in _keys:
        keymap.keymap_items.remove(item)
    _keys.clear()
    unregister_classes()
