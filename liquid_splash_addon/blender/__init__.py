# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that touches Blender, and nothing else: it reads strokes, calls core, writes meshes.

Its rooms, from the lowest to the highest; each imports only from itself, the rooms below and core::

    data     what a .blend file remembers: properties and their registration
    scene    Blender's objects to arrays and back
    jobs     what is computed beside the interface, and when
    ui       operators, panels and menus

This file is above all rooms: it registers them with Blender.
"""

import atexit
import os

import bpy

from .data import model, obstacle_group, preferences, properties, refinements
from .jobs import compose, job, loaded_generator, refine, scheduler
from .scene import model_parts
from .ui import (
    model_operators,
    model_panel,
    operators,
    panels,
    refinement_operators,
    refinement_panel,
    sketch_presets,
)

MODULES = (
    properties,
    model,
    refinements,
    obstacle_group,
    preferences,
    refine,
    compose,
    scheduler,
    model_parts,
    operators,
    model_operators,
    sketch_presets,
    refinement_operators,
    panels,
    refinement_panel,
    model_panel,
)


def keep_compiled_code() -> None:
    """Let numba cache compiled code in the extension's own folder; others may be read-only."""
    if preferences.ADDON.startswith("bl_ext."):
        folder = bpy.utils.extension_path_user(preferences.ADDON, path="compiled", create=True)
        os.environ.setdefault("NUMBA_CACHE_DIR", folder)


def register() -> None:
    """Register all classes, each after those that it needs."""
    keep_compiled_code()
    for module in MODULES:
        module.register()
    # Blender as a Python module hangs at exit if classes with Python functions stay registered.
    if bpy.app.module:
        atexit.register(unregister)


def unregister() -> None:
    """Stop what is running, free the generator and remove all classes, in reverse order."""
    atexit.unregister(unregister)
    job.stop()
    for module in reversed(MODULES):
        module.unregister()
    loaded_generator.free()
