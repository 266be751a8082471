# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a job of Blender's reads the scene in a thread: a render, a bake, an export.

Blender lets timers go on meanwhile. A mesh that one replaces then may be read while it is freed,
and an update of the scene is refused.
"""

from __future__ import annotations

import time

import bpy

from .fluid_domain import is_baking, settings_of

JOBS = ("RENDER", "OBJECT_BAKE")
"""Kinds of jobs that Blender tells of by name. A fluid's bake is none of them."""

LOOK = 1.0
"""Seconds between two searches for fluid domains: they take milliseconds in a large file."""

_looked = float("-inf")
_domains: list[str] = []
"""Names of the objects that were domains then."""


def is_locked() -> bool:
    """Whether nothing may be written now, nor the scene be updated."""
    if any(bpy.app.is_job_running(job) for job in JOBS):
        return True
    managers = bpy.data.window_managers
    return any(one.is_interface_locked for one in managers) or is_fluid_baking()


def is_fluid_baking() -> bool:
    """Whether Mantaflow bakes, in whichever domain of the file."""
    global _looked, _domains
    if time.monotonic() - _looked > LOOK:
        _looked = time.monotonic()
        _domains = [item.name for item in bpy.data.objects if settings_of(item) is not None]
    return any(is_baking(settings_of(bpy.data.objects.get(name))) for name in _domains)
