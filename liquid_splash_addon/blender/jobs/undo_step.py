# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo steps of what is done outside operators."""

from __future__ import annotations

import bpy


def push(message: str) -> None:
    """Let Blender's undo know of a change; it needs a window, which a timer does not have."""
    windows = bpy.context.window_manager.windows
    if bpy.context.window is not None or not windows:
        bpy.ops.ed.undo_push(message=message)
        return
    with bpy.context.temp_override(window=windows[0]):
        bpy.ops.ed.undo_push(message=message)
