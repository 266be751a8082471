# SPDX-License-Identifier: GPL-3.0-or-later
"""What went wrong stays in the panel until its cause is gone: messages pass by unread.

Problems are known by the object that they are about and by what was tried. One is gone once that
works, or once a look at the scene, when something in it has changed, finds no cause any more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy

from . import work_queue

Check = Callable[[], None]
"""Raises ValueError while the cause is there."""

PATIENCE = 0.3
"""Seconds after a change before it is looked again."""


@dataclass
class Problem:
    """Something that could not be done.

    Attributes
    ----------
    sentence : what to do about it
    check : looks whether the cause is still there; None: nobody can tell but by trying again
    """

    sentence: str
    check: Check | None = None


_problems: dict[tuple[int, str], Problem] = {}
_is_due = False


def add(owner: int, tried: str, sentence: str, check: Check | None = None) -> None:
    """Keep a problem.

    owner : session_uid of the object that it is about, 0 for none; tried : name of the operator
    """
    _problems[owner, tried] = Problem(sentence, check)


def clear(owner: int, tried: str) -> None:
    """Forget a problem: it worked."""
    _problems.pop((owner, tried), None)


def dismiss(owners: set[int]) -> None:
    """Forget all problems of some objects: they were read."""
    for key in [key for key in _problems if key[0] in owners]:
        del _problems[key]


def sentences(owners: set[int]) -> list[str]:
    """List what stands in the way of what was tried with some objects."""
    if bpy.app.background:  # no timers
        look_again()
    found = [problem.sentence for (owner, _), problem in _problems.items() if owner in owners]
    return list(dict.fromkeys(found))


def look_again() -> None:
    """Forget the problems whose cause is gone, if anything has changed."""
    global _is_due
    if not _is_due:
        return
    _is_due = False
    for key, problem in list(_problems.items()):
        if problem.check is None:
            continue
        try:
            problem.check()
        except ValueError:
            continue
        except Exception:  # what cannot be looked at must be tried
            continue
        del _problems[key]


@bpy.app.handlers.persistent
def notice(_scene: Any, _graph: Any = None) -> None:
    """Look again soon; this costs nothing where there is no problem."""
    global _is_due
    if not any(problem.check for problem in _problems.values()) or work_queue.is_locked():
        return
    _is_due = True
    if not bpy.app.background and not bpy.app.timers.is_registered(look_later):
        bpy.app.timers.register(look_later, first_interval=PATIENCE)


def look_later() -> None:
    """Look again; the timer."""
    if not work_queue.is_locked():
        look_again()
        work_queue.redraw_sidebars()


@bpy.app.handlers.persistent
def forget(_file: Any = None, _unused: Any = None) -> None:
    """Forget everything: another file is opened."""
    _problems.clear()


def handlers() -> list[tuple[Any, Any]]:
    """Pair each list of handlers in Blender with the function to add to it."""
    known = bpy.app.handlers
    return [
        (known.depsgraph_update_post, notice),
        (known.undo_post, notice),
        (known.redo_post, notice),
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
