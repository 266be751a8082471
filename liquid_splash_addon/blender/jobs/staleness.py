# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a splash is still what its panel and its sketch say, so that settings never lie.

Settings are compared whenever a panel is drawn; strokes and obstacles only after they have changed,
a moment later.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import bpy

from ..data import index
from ..data.properties import to_settings
from ..scene import evaluated
from ..scene.objects import Handle
from ..scene.targets import others_of, target_of
from . import generate, work_queue

PATIENCE = 0.3
"""Seconds after a change before strokes are looked at."""

GO_ON = 0.02
"""Seconds until the next splashes are looked at where there are many."""

_seen: dict[int, str] = {}
"""Digests of what splashes would be made of, by session_uid, when it was last looked at."""

_waiting: set[Handle] = set()
"""Splashes that are to be looked at."""


def is_out_of_date(splash: bpy.types.Object) -> bool:
    """Whether a splash would become another if it was made again now."""
    record = splash.splash
    if record.made_with and record.made_with != repr(to_settings(record.settings)):
        return True
    if bpy.app.background:  # no timers
        look()
    return not evaluated.is_made_of(splash, _seen.get(splash.session_uid, record.made_of))


def digest_now(splash: bpy.types.Object) -> str:
    """Return the digest of what a splash would be made of now; reads all of its strokes.

    That of what it was made of where it cannot be told: that is a problem of its own.
    """
    made_of = str(splash.splash.made_of)
    if splash.splash.sketch is None:
        return made_of
    settings = to_settings(splash.splash.settings)
    try:
        return generate.snapshot(bpy.context, target_of(splash), settings).digest
    except ValueError:
        return made_of


def look(seconds: float = float("inf")) -> None:
    """Look at the splashes that wait for it, for some seconds; at one at the least."""
    end = time.monotonic() + seconds
    while _waiting:
        splash = _waiting.pop().find()
        if splash is not None and splash.splash.made_of:
            _seen[splash.session_uid] = digest_now(splash)
        if time.monotonic() > end:
            break


def look_later() -> float | None:
    """Look; the timer."""
    if work_queue.is_locked() or work_queue.running() is not None:
        return PATIENCE
    look(work_queue.SLICE)
    work_queue.redraw_sidebars()
    return GO_ON if _waiting else None


def sources_of(splash: bpy.types.Object) -> Iterable[bpy.types.Object]:
    """Yield the objects that a splash depends on."""
    if splash.splash.sketch is not None:
        yield splash.splash.sketch
    yield from others_of(splash)
    if splash.splash_obstacles.collection is not None:
        yield from splash.splash_obstacles.collection.all_objects


@bpy.app.handlers.persistent
def notice(_scene: Any, graph: bpy.types.Depsgraph) -> None:
    """Have the splashes looked at whose strokes or obstacles were changed."""
    splashes = index.splashes()
    if not splashes or work_queue.is_locked():
        return
    changed = {update.id.original for update in graph.updates}
    for splash in splashes:
        for item in sources_of(splash):
            if item in changed or item.data in changed:
                _waiting.add(Handle.of(splash))
                break
    if _waiting:
        look_soon()


def look_soon() -> None:
    """Have what waits looked at in a moment, beside the interface."""
    if not bpy.app.background and not bpy.app.timers.is_registered(look_later):
        bpy.app.timers.register(look_later, first_interval=PATIENCE)


@bpy.app.handlers.persistent
def forget(_file: Any = None, _unused: Any = None) -> None:
    """Forget everything: another file is opened."""
    _seen.clear()
    _waiting.clear()


@bpy.app.handlers.persistent
def look_at_all(_scene: Any, _graph: Any = None) -> None:
    """Look at all splashes again: undo and redo may have changed strokes."""
    _waiting.update(Handle.of(splash) for splash in index.splashes())
    if _waiting:
        look_soon()


def handlers() -> list[tuple[Any, Any]]:
    """Pair each list of handlers in Blender with the function to add to it."""
    known = bpy.app.handlers
    return [
        (known.depsgraph_update_post, notice),
        (known.undo_post, look_at_all),
        (known.redo_post, look_at_all),
        (known.load_pre, forget),
    ]


def register() -> None:
    """Notice changes."""
    for known, handler in handlers():
        known.append(handler)


def unregister() -> None:
    """Stop noticing."""
    for known, handler in handlers():
        known.remove(handler)
    if bpy.app.timers.is_registered(look_later):
        bpy.app.timers.unregister(look_later)
    forget()
