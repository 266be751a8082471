# SPDX-License-Identifier: GPL-3.0-or-later
"""The splash that follows the hand: a draft after each change, the full resolution at rest.

Blender says that something changed, not what. A timer looks whether the active sketch, with its
settings, is still what its splash was made of, and has it made again if not. No undo steps are made
of it: whatever undo brings back, the splash follows that too.
"""

from __future__ import annotations

from typing import Any

import bpy

from ..data.properties import to_settings
from ..scene import evaluated
from ..scene.objects import SceneError
from ..scene.targets import Target, find_target
from . import draft_then_full, generate, work_queue
from .messages import sentence_for

LOOK = 0.03
"""Seconds from a change to the look at it, and between two looks while a brush is down."""

REST = 0.6
"""Seconds without a change after which the full resolution is begun."""

BRUSH = "GREASE_PENCIL_OT_brush_stroke"

_asked: tuple[object, ...] = ()
"""What was asked for last: it is not asked for twice, whatever became of it."""

_said = ""

_brush_was_down = False
"""Whether a brush was down at the last change."""


def said() -> str:
    """Return what was made last, or what went wrong, in words."""
    return _said


def is_drawing() -> bool:
    """Whether a brush is down in any window: its stroke is not yet whole."""
    windows = bpy.context.window_manager.windows
    return any(BRUSH in window.modal_operators for window in windows)


def is_making() -> bool:
    """Whether a splash that follows is being computed, or rests before the full resolution."""
    making = draft_then_full.making()
    return making is not None and making.is_busy


def stop() -> None:
    """Stop what is being made; the next change begins anew."""
    making = draft_then_full.making()
    if making is not None:
        making.cancel()


def look() -> float | None:
    """Have the splash made anew if it is out of date; None ends the timer."""
    if not bpy.context.scene.splash.live:
        return None
    if is_drawing() or work_queue.is_locked() or work_queue.collecting() is not None:
        return LOOK
    if bpy.context.screen is not None and bpy.context.screen.is_animation_playing:
        return None
    target = find_target(bpy.context)
    if target is not None:
        try:
            follow(target)
        except (SceneError, ValueError) as error:
            tell(sentence_for(error))
    return None


def follow(target: Target) -> None:
    """Ask for the splash of ``target`` if it is made of something else, and not asked for yet.

    Raises SceneError or StrokeError where it cannot be made of what there is now.
    """
    global _asked
    splash = target.splash
    owner = bpy.context.scene if splash is None else splash
    request = generate.snapshot(bpy.context, target, to_settings(owner.splash.settings))
    wanted = (request.sketch, request.layer, request.digest)
    is_new = wanted != _asked
    _asked = wanted
    is_made = splash is not None and evaluated.is_made_of(splash, request.digest)
    if is_new and request.drawings and (not is_made or is_making()):
        draft_then_full.make(target, tell, rest=REST, is_step=False)
        work_queue.begin()  # a timer would first wait for the viewport


def tell(sentence: str) -> None:
    """Keep a sentence for the panel."""
    global _said
    _said = sentence


def notice() -> None:
    """Look soon."""
    if not bpy.app.timers.is_registered(look):
        bpy.app.timers.register(look, first_interval=LOOK)


@bpy.app.handlers.persistent
def after_change(scene: bpy.types.Scene, _graph: Any = None) -> None:
    """Look soon after any change of a scene that is live; at once when a brush was lifted.

    Timers wait until Blender has drawn the viewport, which may take as long as a draft: so both
    are done side by side.
    """
    global _brush_was_down
    if not scene.splash.live or work_queue.is_immediate() or work_queue.is_locked():
        return
    was_down, _brush_was_down = _brush_was_down, is_drawing()
    if not was_down or _brush_was_down or look() is not None:
        notice()


@bpy.app.handlers.persistent
def after_undo(scene: bpy.types.Scene, graph: Any = None) -> None:
    """Look soon: the splash may be the one before, of strokes that stayed."""
    global _asked
    _asked = ()
    after_change(scene, graph)


@bpy.app.handlers.persistent
def forget(_file: Any = None, _unused: Any = None) -> None:
    """Know nothing of a file that is going."""
    global _asked, _said, _brush_was_down
    _asked, _said, _brush_was_down = (), "", False


def handlers() -> list[tuple[Any, Any]]:
    """Pair each list of handlers in Blender with the function to add to it."""
    known = bpy.app.handlers
    return [
        (known.depsgraph_update_post, after_change),
        (known.undo_post, after_undo),
        (known.redo_post, after_undo),
        (known.load_pre, forget),
    ]


def register() -> None:
    """Listen to changes."""
    for known, handler in handlers():
        known.append(handler)


def unregister() -> None:
    """Stop listening."""
    for known, handler in handlers():
        known.remove(handler)
    if bpy.app.timers.is_registered(look):
        bpy.app.timers.unregister(look)
    forget()
