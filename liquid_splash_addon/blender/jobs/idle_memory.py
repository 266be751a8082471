# SPDX-License-Identifier: GPL-3.0-or-later
"""Memory given back: networks and intermediate results that only save time.

A splash takes a few seconds longer without them. They are dropped by a button, and by themselves
once nothing has been computed for a while: Blender needs the memory for a render then.
"""

from __future__ import annotations

import ctypes
import sys
import threading
import time

import bpy

from ..scene import obstacles
from . import compose, loaded_generator, refine, work_queue

IDLE = 300.0
"""Seconds without anything computed after which memory is given back."""

LOOK = 30.0
"""Seconds between two looks at how long nothing was computed."""


def free() -> None:
    """Drop what can be made again. Only while nothing is computed."""
    loaded_generator.free()
    refine.free()
    compose.free()
    obstacles.forget()


def give_back() -> None:
    """Drop it, and have the system know."""
    free()
    if sys.platform == "linux":
        threading.Thread(target=trim, name="Liquid Splash", daemon=True).start()


def trim() -> None:
    """Have the C library return what was freed to the system; glibc alone keeps it."""
    try:
        ctypes.CDLL(None).malloc_trim(0)
    except (OSError, AttributeError):  # another C library
        pass


def is_kept() -> bool:
    """Whether there is something to give back."""
    kept = refine.refiner is not None or compose.composer is not None
    return kept or loaded_generator.is_loaded()


def look() -> float:
    """Give memory back if nothing was computed for IDLE seconds."""
    idle = time.monotonic() - work_queue.last_used()
    if idle > IDLE and not work_queue.is_busy() and is_kept():
        give_back()
    return LOOK


def register() -> None:
    """Look from now on. In the background nobody waits, and scripts mean to go on."""
    if not bpy.app.background:
        bpy.app.timers.register(look, first_interval=LOOK, persistent=True)


def unregister() -> None:
    """Look no more, and drop all."""
    if bpy.app.timers.is_registered(look):
        bpy.app.timers.unregister(look)
    free()
