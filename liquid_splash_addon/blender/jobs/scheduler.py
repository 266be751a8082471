# SPDX-License-Identifier: GPL-3.0-or-later
"""Keep splashes and models up to date: what was changed is evaluated soon after, by the queue.

In the background, where there is no window, it is done at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy

from ...core.progress import silent
from ..data import index, revisions
from ..scene import evaluated
from ..scene.objects import Handle, SceneError
from . import work_queue
from .messages import sentence_for
from .work_queue import Entry, Work

if TYPE_CHECKING:
    from ...core.progress import Report

FAILED = "failed"
"""Recorded in place of a key where a mesh could not be updated. No task has this key, so the next
change is evaluated, even one back to what the mesh was made of, and clears the warning."""


class Kind(NamedTuple):
    """A kind of object that is evaluated, and how.

    Attributes
    ----------
    owns : whether an object is of this kind
    record : an object's property group with ``evaluated`` and ``warnings``
    task_of : reads all that the work needs; the task's ``key`` is unique to it; raises ValueError
    compute : does the work, without bpy; raises ValueError
    write : writes the result
    """

    owns: Callable[[bpy.types.Object], bool]
    record: Callable[[bpy.types.Object], Any]
    task_of: Callable[[bpy.types.Object], Any]
    compute: Callable[[Any, Report], Any]
    write: Callable[[bpy.types.Object, Any, Any], None]


_kinds: list[Kind] = []
_held: dict[int, Entry] | None = None
_failures: dict[int, str] = {}
"""Why objects could not be evaluated when it was last tried, by session_uid."""


def kind_of(item: bpy.types.Object) -> Kind | None:
    """Return the kind of ``item``; None if it is not evaluated."""
    return next((kind for kind in _kinds if kind.owns(item)), None)


def evaluate(item: bpy.types.Object, kind: Kind | None = None) -> None:
    """Evaluate ``item`` now, even if it is up to date. On ValueError it stays as it is."""
    kind = kind or kind_of(item)
    if kind is not None:
        task = kind.task_of(item)
        kind.write(item, task, kind.compute(task, silent))


def request(item: bpy.types.Object) -> None:
    """Have ``item`` evaluated soon; at once where there is no window.

    If that fails, the reason becomes its warning and the mesh stays as it is.
    """
    kind = kind_of(item)
    if kind is None:
        return
    handle = Handle.of(item)
    entry = Entry(handle.uid, partial(_read, handle, kind), partial(_fail, handle, kind))
    if not work_queue.is_immediate() and item.is_editable:
        kind.record(item).pending = True
    if _held is not None:
        _held[handle.uid] = entry
    elif work_queue.is_immediate():
        work_queue.run_now(entry)
    else:
        _put(entry)


def _put(entry: Entry) -> None:
    """Put an entry in the queue, unless its object has one that still waits."""
    before = work_queue.entry_of(entry.owner)
    if before is not None:
        if before.job is None:
            return
        before.cancel()  # a newer one will be read: do not wait for the old result
    work_queue.put(entry)


@contextmanager
def held() -> Iterator[None]:
    """Put off what is requested in this block until its end, so that many changes count as one."""
    global _held
    outer, _held = _held, {} if _held is None else _held
    try:
        yield
    finally:
        waiting, _held = _held, outer
        if outer is None:
            for entry in waiting.values():
                if work_queue.is_immediate():
                    work_queue.run_now(entry)
                else:
                    _put(entry)


def stage_of(item: bpy.types.Object) -> str:
    """Describe what is being done to ``item``; "" if it is up to date."""
    entry = work_queue.entry_of(item.session_uid)
    return "" if entry is None else f"{entry.stage} ..."


def _read(handle: Handle, kind: Kind) -> Work | None:
    """Read what has to be done to an object; None if it is gone or up to date."""
    item = handle.find()
    if item is None or not kind.owns(item):
        return None
    _failures.pop(handle.uid, None)
    task = kind.task_of(item)
    if evaluated.is_made_by(item, kind.record(item), task.key):
        kind.record(item).pending = False
        return None
    return Work(task.key, partial(kind.compute, task), partial(kind.write, item, task))


def _fail(handle: Handle, kind: Kind, error: Exception) -> None:
    """Make the reason why an object stays as it is its warning."""
    item = handle.find()
    if item is not None:
        record = kind.record(item)
        record.warnings = _failures[handle.uid] = sentence_for(error)
        record.evaluated, record.pending = record.evaluated and FAILED, False
        item.update_tag()


def raise_failure(item: bpy.types.Object) -> None:
    """Raise SceneError with the warning of an object that could not be evaluated."""
    kind = kind_of(item)
    if kind is not None and (failure := _failures.get(item.session_uid)):
        raise SceneError(failure)


@bpy.app.handlers.persistent
def after_undo(_scene: Any, _graph: Any = None) -> None:
    """Evaluate what undo and redo have left out of date."""
    if work_queue.is_immediate():
        bpy.context.view_layer.update()  # where objects stand is not known yet
    with held():
        for item in (*index.splashes(), *index.models()):
            kind = kind_of(item)
            if kind is not None and kind.record(item).evaluated:
                request(item)


_seen_revision = 0


@bpy.app.handlers.persistent
def after_update(_scene: Any, _graph: Any = None) -> None:
    """Evaluate copies that were made before the original had followed its last change."""
    global _seen_revision
    if index.revision() == _seen_revision or work_queue.is_locked():
        return
    _seen_revision = index.revision()
    go_on()


@bpy.app.handlers.persistent
def go_on(_file: Any = None, _unused: Any = None) -> None:
    """Evaluate what has yet to follow a change and is not in the queue, as in a file just opened.

    Other objects of a file stay as they were saved.
    """
    with held():
        for item in (*index.splashes(), *index.models()):
            kind = kind_of(item)
            is_queued = work_queue.entry_of(item.session_uid) is not None
            if kind is not None and kind.record(item).pending and not is_queued:
                request(item)


def handlers() -> list[tuple[Any, Any]]:
    """Pair each list of handlers in Blender with the function to add to it."""
    known = bpy.app.handlers
    return [
        (known.undo_post, after_undo),
        (known.redo_post, after_undo),
        (known.load_post, go_on),
        (known.depsgraph_update_post, after_update),
    ]


def add(kind: Kind) -> None:
    """Have objects of this kind evaluated from now on."""
    _kinds.append(kind)


def register() -> None:
    """Listen to changes, and to undo and redo."""
    revisions.listen(request)
    for known, handler in handlers():
        known.append(handler)


def unregister() -> None:
    """Stop listening."""
    revisions.ignore(request)
    for known, handler in handlers():
        known.remove(handler)
    _kinds.clear()
