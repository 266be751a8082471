# SPDX-License-Identifier: GPL-3.0-or-later
"""Keep splashes and models up to date: what was changed is evaluated soon after.

With a window the work is done in a thread, one object at a time, and a timer writes the results.
In the background it is done at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy

from ..data import revisions
from ..scene.objects import by_uid
from .job import STOP_SECONDS, Job, redraw_sidebars

if TYPE_CHECKING:
    from ...core.progress import Report

TICK = 0.03
"""Seconds between two checks of the thread."""

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


class Run(NamedTuple):
    """What the thread works on: the object's session_uid, its kind, its task and the job."""

    uid: int
    kind: Kind
    task: Any
    job: Job


_kinds: list[Kind] = []
_waiting: dict[int, Kind] = {}
_running: Run | None = None
_holding = False


def kind_of(item: bpy.types.Object) -> Kind | None:
    """Return the kind of ``item``; None if it is not evaluated."""
    return next((kind for kind in _kinds if kind.owns(item)), None)


def evaluate(item: bpy.types.Object, kind: Kind | None = None) -> None:
    """Evaluate ``item`` now, even if it is up to date. On ValueError it stays as it is."""
    kind = kind or kind_of(item)
    if kind is not None:
        task = kind.task_of(item)
        kind.write(item, task, kind.compute(task, lambda stage, share: None))


def request(item: bpy.types.Object) -> None:
    """Have ``item`` evaluated soon; at once where there is no window.

    If that fails, the reason becomes its warning and the mesh stays as it is.
    """
    kind = kind_of(item)
    if kind is None:
        return
    _waiting[item.session_uid] = kind
    if bpy.app.background:
        if not _holding:
            _evaluate_waiting()
        return
    if _running is not None and _running.uid == item.session_uid:
        _running.job.cancel()
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=TICK)


@contextmanager
def held() -> Iterator[None]:
    """Put off what is requested in this block until its end, so that many changes count as one."""
    global _holding
    before, _holding = _holding, True
    try:
        yield
    finally:
        _holding = before
        if bpy.app.background and not _holding:
            _evaluate_waiting()


def stage_of(item: bpy.types.Object) -> str:
    """Describe what is being done to ``item``; "" if it is up to date."""
    if _running is not None and _running.uid == item.session_uid:
        return f"{_running.job.stage} ..."
    return "Waiting ..." if item.session_uid in _waiting else ""


def _next() -> tuple[bpy.types.Object, Kind] | None:
    """Take the object that has waited longest and still exists."""
    while _waiting:
        uid = next(iter(_waiting))
        kind, item = _waiting.pop(uid), by_uid(uid)
        if item is not None:
            return item, kind
    return None


def _evaluate_waiting() -> None:
    while found := _next():
        item, kind = found
        _warn_on_error(item.session_uid, kind, partial(_update, item, kind))


def _update(item: bpy.types.Object, kind: Kind) -> None:
    if kind.task_of(item).key != kind.record(item).evaluated:
        evaluate(item, kind)


def _tick() -> float | None:
    """Write what is done and begin what waits; None ends the timer."""
    global _running
    redraw_sidebars()
    if _running is not None:
        if not _running.job.is_done:
            return TICK
        run, _running = _running, None
        _warn_on_error(run.uid, run.kind, partial(_collect, run))
    while _running is None and (found := _next()):
        item, kind = found
        _warn_on_error(item.session_uid, kind, partial(_begin, item, kind))
    return TICK if _running is not None else None


def _begin(item: bpy.types.Object, kind: Kind) -> None:
    global _running
    task = kind.task_of(item)
    if task.key != kind.record(item).evaluated:
        _running = Run(item.session_uid, kind, task, Job(partial(kind.compute, task)))


def _collect(run: Run) -> None:
    from ...core.progress import Cancelled

    try:
        outcome = run.job.result()
    except Cancelled:
        return
    item = by_uid(run.uid)
    if item is not None:
        run.kind.write(item, run.task, outcome)


def _warn_on_error(uid: int, kind: Kind, action: Callable[[], None]) -> None:
    """Run ``action``; if it fails, the reason becomes the warning of the object ``uid``."""
    try:
        action()
    except ValueError as error:
        item = by_uid(uid)
        if item is not None:
            record = kind.record(item)
            record.warnings = str(error)
            record.evaluated = record.evaluated and FAILED


@bpy.app.handlers.persistent
def after_undo(_scene: Any, _graph: Any = None) -> None:
    """Evaluate what undo and redo have left out of date."""
    with held():
        for item in bpy.data.objects:
            kind = kind_of(item)
            if kind is not None and kind.record(item).evaluated:
                request(item)


HANDLERS = (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post)


def add(kind: Kind) -> None:
    """Have objects of this kind evaluated from now on."""
    _kinds.append(kind)


def register() -> None:
    """Listen to changes, and to undo and redo."""
    revisions.listen(request)
    for handlers in HANDLERS:
        handlers.append(after_undo)


def unregister() -> None:
    """Stop listening, and stop what is running."""
    global _running
    revisions.ignore(request)
    for handlers in HANDLERS:
        handlers.remove(after_undo)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if _running is not None:
        _running.job.cancel()
        _running.job.wait(STOP_SECONDS)
    _waiting.clear()
    _kinds.clear()
    _running = None
