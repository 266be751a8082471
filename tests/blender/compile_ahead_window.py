# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_compile_ahead.py in a Blender with a window where the extension is installed.

Shows the tab, waits until compiling ahead says how far it is, and quits in the middle of it.
"""

import importlib
import sys
import time
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from running_scripts import show_tab

PACKAGE = "bl_ext.user_default.liquid_splash"
PATIENCE = 600.0
"""Seconds until what does not happen is a failure."""

ahead = importlib.import_module(f"{PACKAGE}.blender.jobs.compile_ahead")
end = time.monotonic() + PATIENCE


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
