# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a job of Blender's reads the scene in a thread: a render, a bake, an export.

Blender lets timers go on meanwhile. A mesh that one replaces then may be read while it is freed,
and an update of the scene is refused.
"""

from __future__ import annotations

import time
from typing import Any

import bpy

from .fluid_domain import is_baking, settings_of

JOBS = ("RENDER", "OBJECT_BAKE")
"""Kinds of jobs that Blender tells of by name. A fluid's bake is none of them."""

LOOK = 1.0
"""Seconds between two searches for fluid domains: they take milliseconds in a large file."""

_looked = float("-inf")
_domains: list[str] = []
"""Names of the objects that were domains then."""


_is_rendering = False
"""Whether a render of the background runs: it is none of Blender's jobs."""


def is_locked() -> bool:
    """Whether nothing may be written now, nor the scene be updated."""
    if _is_rendering or any(bpy.app.is_job_running(job) for job in JOBS):
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


@bpy.app.handlers.persistent
def begin_render(_scene: Any = None, _unused: Any = None) -> None:
    """Note that a render begins."""
    global _is_rendering
    _is_rendering = bool(bpy.app.background)


@bpy.app.handlers.persistent
def end_render(_scene: Any = None, _unused: Any = None) -> None:
    """Note that it is over, or that another file is open."""
    global _is_rendering
    _is_rendering = False


def handlers() -> list[tuple[Any, Any]]:
    """Pair each list of handlers in Blender with the function to add to it."""
    known = bpy.app.handlers
    return [
        (known.render_init, begin_render),
        (known.render_complete, end_render),
        (known.render_cancel, end_render),
        (known.load_post, end_render),
    ]


def register() -> None:
    """Notice renders."""
    for known, handler in handlers():
        known.append(handler)


def unregister() -> None:
    """Stop noticing."""
    for known, handler in handlers():
        known.remove(handler)
    end_render()
