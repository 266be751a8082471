# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that touches Blender, and nothing else: it reads strokes, calls core, writes meshes.

::

    grease_pencil  strokes of a Grease Pencil object -> core's Drawings
    mesh_object    core's Splash -> a mesh object with its velocity, frame and fields
    material       the shared water material
    generation     one run: snapshot the scene, compute (no bpy, any thread), write the result
    sketch         new Grease Pencil objects to draw on; sketch_presets adds drawn ones
    job            a run in a worker thread, with progress and cancelling
    dependencies   packages that Blender does not bring along, and how to install them
    generators     loaded weights, kept until the add-on goes
    obstacle_group, obstacles   the meshes that each splash keeps out of
    refinements    the list of refinements on each splash; evaluation refines anew on a change
    drop_points    the drops that fly free, as a point cloud
    layers         a splash for each layer of a sketch; targets tells which splash is meant
    model          several splashes as one: model_parts lists them, model_evaluation joins them
    scheduler      evaluates what was changed, splash or model, in a thread
    properties, preferences, operators, panels   what Blender registers
"""

import atexit
import os

import bpy

from .data import model, obstacle_group, preferences, properties, refinements
from .jobs import compose, refine, scheduler
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
    """Have numba keep what it compiles in the extension's own folder: others may be read-only."""
    extension = __package__.rpartition(".")[0]
    if extension.startswith("bl_ext."):
        folder = bpy.utils.extension_path_user(extension, path="compiled", create=True)
        os.environ.setdefault("NUMBA_CACHE_DIR", folder)


def register() -> None:
    """Register all classes, in the order in which they need each other."""
    keep_compiled_code()
    for module in MODULES:
        module.register()
    # As a Python module Blender hangs at exit while classes with Python functions are registered.
    if bpy.app.module:
        atexit.register(unregister)


def unregister() -> None:
    """Stop what is running, free the generator and remove all classes, in reverse order."""
    from .jobs import job, loaded_generator

    atexit.unregister(unregister)
    job.stop()
    for module in reversed(MODULES):
        module.unregister()
    loaded_generator.free()
