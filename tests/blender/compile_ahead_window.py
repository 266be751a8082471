# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_compile_ahead.py in a Blender with a window where the extension is installed.

Shows the tab, waits until compiling ahead says how far it is, and quits in the middle of it.
"""

import importlib
import time

import bpy

PACKAGE = "bl_ext.user_default.liquid_splash"
PATIENCE = 600.0
"""Seconds until what does not happen is a failure."""

ahead = importlib.import_module(f"{PACKAGE}.blender.jobs.compile_ahead")
end = time.monotonic() + PATIENCE


def show_tab() -> bool:
    """Open the sidebar at the tab; return whether it is shown."""
    area = next(
        a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D"
    )
    area.spaces.active.show_region_ui = True
    region = next(r for r in area.regions if r.type == "UI")
    try:
        region.active_panel_category = "Splash"
    except (AttributeError, TypeError):  # it was not drawn yet
        return False
    return True


def watch() -> float | None:
    """Quit once compiling ahead goes on, or when patience is at its end."""
    running = ahead.running()
    is_on = show_tab() and running is not None and running.stage != ""
    if is_on or time.monotonic() > end:
        pid = running._process.pid if running is not None else 0
        print(
            f"window: {'works' if is_on else 'fails'}, pid {pid}, note '{ahead.note()}'", flush=True
        )
        bpy.ops.wm.quit_blender()
        return None
    return 0.2


bpy.app.timers.register(watch, first_interval=1.0)
