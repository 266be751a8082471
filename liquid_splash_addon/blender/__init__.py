# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that touches Blender, and nothing else: it reads strokes, calls core, writes meshes.

Its rooms, from the lowest to the highest; each imports only from itself, the rooms below and core::

    data     what a .blend file remembers: properties and their registration
    scene    Blender's objects to arrays and back
    jobs     what is computed beside the interface, and when
    capture  drawing with tracked hands, in virtual reality
    ui       operators, panels and menus

This file is above all rooms: it registers them with Blender.
"""

import atexit
from pathlib import Path

import bpy

from ..core import compiled_code
from .capture import action_set, vr_drawing
from .data import (
    capture,
    index,
    look,
    mantaflow,
    model,
    motion,
    obstacle_group,
    preferences,
    properties,
    refinements,
    simulation,
    stored_liquid,
)
from .jobs import (
    bake_mantaflow,
    compile_ahead,
    compose,
    draft_then_full,
    estimates,
    idle_memory,
    live,
    problems,
    refine,
    scheduler,
    speed_map,
    staleness,
    work_queue,
)
from .scene import drop_points, locks, model_parts, moving_obstacles, saved_elsewhere
from .scene import motion as scene_motion
from .ui import (
    bake_operators,
    bake_panel,
    export_vdb,
    liquid_operators,
    live_operators,
    look_panel,
    mantaflow_operators,
    mantaflow_panel,
    model_operators,
    model_panel,
    motion_operators,
    motion_panel,
    operators,
    panels,
    preferences_operators,
    preferences_panel,
    queued_operator,
    refinement_operators,
    refinement_panel,
    select_named,
    simulate_operators,
    simulate_panel,
    sketch_presets,
    sketch_tool,
    speed_overlay,
    splash_operators,
    stroke_files,
    stroke_tools,
    strokes_from_flow,
    studio_operators,
    viewport_hint,
    vr_panel,
)

MODULES = (
    index,
    properties,
    stored_liquid,
    model,
    refinements,
    look,
    obstacle_group,
    simulation,
    motion,
    capture,
    mantaflow,
    preferences,
    work_queue,
    problems,
    refine,
    compose,
    idle_memory,
    scheduler,
    staleness,
    bake_mantaflow,
    compile_ahead,
    estimates,
    speed_map,
    draft_then_full,
    live,
    action_set,
    vr_drawing,
    locks,
    drop_points,
    model_parts,
    moving_obstacles,
    saved_elsewhere,
    scene_motion,
    queued_operator,
    operators,
    select_named,
    splash_operators,
    model_operators,
    sketch_presets,
    sketch_tool,
    stroke_files,
    strokes_from_flow,
    refinement_operators,
    liquid_operators,
    studio_operators,
    motion_operators,
    simulate_operators,
    bake_operators,
    mantaflow_operators,
    export_vdb,
    live_operators,
    panels,
    stroke_tools,
    refinement_panel,
    model_panel,
    preferences_operators,
    preferences_panel,
    look_panel,
    motion_panel,
    simulate_panel,
    bake_panel,
    vr_panel,
    mantaflow_panel,
    speed_overlay,
    viewport_hint,
)


def keep_compiled_code() -> None:
    """Have compiled code kept in the extension's own folder; others may be read-only."""
    if preferences.ADDON.startswith("bl_ext."):
        folder = bpy.utils.extension_path_user(preferences.ADDON, path="compiled")
        compiled_code.keep_below(Path(folder))


_is_registered = False


def register() -> None:
    """Register all classes, each after those that it needs."""
    global _is_registered
    keep_compiled_code()
    for module in MODULES:
        module.register()
    _is_registered = True
    # Blender as a Python module hangs at exit if classes with Python functions stay registered.
    if bpy.app.module:
        atexit.register(unregister)


def unregister() -> None:
    """Stop what is running, free memory and remove all classes, in reverse order."""
    global _is_registered
    if not _is_registered:  # at exit Blender's module calls it once more for an enabled extension
        return
    _is_registered = False
    atexit.unregister(unregister)
    for module in reversed(MODULES):
        module.unregister()
    compiled_code.forget()
