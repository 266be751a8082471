# SPDX-License-Identifier: GPL-3.0-or-later
"""Mantaflow in Blender as a Python module, where it is built in too early to work.

The module's types are made before their base classes are registered, so a level set has no methods
and a bake ends with nothing. Making the module once more, after a first domain has registered
them, mends it. A real Blender needs none of this.
"""

import ctypes
import sys

import bpy


def mend() -> None:
    """Make Mantaflow work, once in a process."""
    if not bpy.app.module or getattr(sys, "mantaflow_is_mended", False):
        return
    bpy.ops.mesh.primitive_cube_add()
    item = bpy.context.object
    modifier = item.modifiers.new("Fluid", "FLUID")
    modifier.fluid_type = "DOMAIN"
    modifier.domain_settings.domain_type = "LIQUID"
    bpy.context.view_layer.update()
    with open("/proc/self/maps", encoding="utf-8") as file:
        path = next(line.split()[-1] for line in file if "bpy/__init__" in line)
    make = ctypes.PyDLL(path).PyInit_manta_main
    make.restype = ctypes.py_object
    sys.modules["manta"] = make()
    bpy.data.objects.remove(item)
    sys.mantaflow_is_mended = True  # type: ignore[attr-defined]
