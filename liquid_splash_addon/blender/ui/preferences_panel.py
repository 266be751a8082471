# SPDX-License-Identifier: GPL-3.0-or-later
"""What the preferences show below their settings: packages, device, memory, help."""

from __future__ import annotations

import time
from typing import Any

import bpy

from ...core import compiled_code
from ...core.packages import OLDEST, PACKAGES, broken_packages, is_installed, is_too_old, version_of
from ..data.preferences import SECTIONS, own_preferences
from .panels import draw_missing
from .preferences_operators import (
    SPLASH_OT_clear_cache,
    SPLASH_OT_copy_report,
    SPLASH_OT_free_memory,
    SPLASH_OT_test_device,
)

FRESH = 2.0
"""Seconds that what was read from the disk is shown: drawing happens many times a second."""

_read: tuple[float, list[tuple[str, str, str]], int] | None = None


def packages_and_size() -> tuple[list[tuple[str, str, str]], int]:
    """Return name, state and icon of each package, and the size of the compiled code."""
    global _read
    now = time.monotonic()
    if _read is None or now - _read[0] > FRESH:
        _read = now, [state_of(module) for module in PACKAGES], compiled_code.size()
    return _read[1:]


def state_of(module: str) -> tuple[str, str, str]:
    """Return the name, state and icon of a package."""
    name = PACKAGES[module]
    if not is_installed(module):
        return name, "missing", "ERROR"
    if name in broken_packages():
        return name, "broken: install it again", "ERROR"
    version = version_of(module) or "installed"
    if is_too_old(module):
        return name, f"{version}, older than tested: install {OLDEST[module]} or later", "ERROR"
    return name, version, "CHECKMARK"


def draw(layout: Any, context: bpy.types.Context) -> None:
    """Draw what helps: whether all is there, how fast it is, and what to do about it."""
    packages, size = packages_and_size()
    preferences = own_preferences(context)
    row = layout.row()
    row.label(text=(preferences.tested if preferences else "") or "Speed of the device: not tested")
    row.operator(SPLASH_OT_test_device.bl_idname, icon="TIME")
    box = layout.box()
    for name, state, icon in packages:
        split = box.split(factor=0.3)
        split.label(text=name, icon=icon)
        split.label(text=state)
    draw_missing(layout, context)
    row = layout.row()
    row.label(text=f"Compiled code: {size / 1e6:.0f} MB")
    row.operator(SPLASH_OT_clear_cache.bl_idname, icon="TRASH")
    row = layout.row()
    row.operator(SPLASH_OT_free_memory.bl_idname, icon="MEMORY")
    row.operator(SPLASH_OT_copy_report.bl_idname, icon="COPYDOWN")


def register() -> None:
    """Have it drawn into the preferences."""
    SECTIONS.append(draw)


def unregister() -> None:
    """Have it drawn no more."""
    SECTIONS.remove(draw)
