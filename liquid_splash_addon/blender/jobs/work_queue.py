# SPDX-License-Identifier: GPL-3.0-or-later
"""The one queue for work on scene objects: one piece at a time, computed in a thread.

It has a second lane for pieces that processes of their own compute, for minutes, while a thread
merely waits: those come one after another too, but nothing else waits for them.

A piece of work is read from the scene, computed without bpy, and written. It carries a key of all
that it was read from. When it is done the scene is read again: the result is written only if the
key is still the same, else what is wanted now is computed. So undo, redo, copies and edits in
flight need no tracking. Nothing is written while a render or a bake runs.
"""

from __future__ import annotations

import contextlib
import time
import traceback
from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy

from ...core.progress import silent
from ..scene.locks import is_locked
from . import main_thread
from .job import STOP_SECONDS, Job, redraw_sidebars
from .messages import is_no_memory

if TYPE_CHECKING:
    from ...core.progress import Report

LONG = 3
"""Seconds from which a piece of work says how many it has taken, so that its line moves."""

TICK = 0.03
"""Seconds between two looks at the thread."""

SLICE = 0.01
"""Seconds for which work is read from the scene before Blender has its turn again."""


class Work(NamedTuple):
    """What is to be done, as read from the scene.

    Attributes
    ----------
    key : equal keys, equal results
    compute : does it, without bpy
    write : writes the result into the scene
    """

    key: Hashable
    compute: Callable[[Report], Any]
    write: Callable[[Any], Any]


class Entry:
    """A place in the queue.

    Attributes
    ----------
    owner : session_uid of the object whose panel shows it, 0 for none
    read : reads the work from the scene; None if there is nothing to do any more
    fail : is told of the error that ended it
    collected : whether an operator writes the result, so that Blender's undo knows of it
    beside : whether a process of its own does it
    error : what ended it
    is_dropped : whether it left the queue without a result
    window : address of the window whose operator writes the result; 0 for none
    """

    window = 0

    def __init__(
        self,
        owner: int,
        read: Callable[[], Work | None],
        fail: Callable[[Exception], None],
        collected: bool = False,
        beside: bool = False,
    ) -> None:
        self.owner, self.read, self.fail = owner, read, fail
        self.collected, self.beside = collected, beside
        self.work: Work | None = None
        self.job: Job | None = None
        self.error: Exception | None = None
        self.is_dropped = False

    @property
    def is_ready(self) -> bool:
        """Whether the thread has ended and nothing stands in the way of writing."""
        return self.job is not None and self.job.is_done and not is_locked()

    @property
    def stage(self) -> str:
        """What is being done."""
        return "Waiting" if self.job is None else self.job.stage

    @property
    def line(self) -> str:
        """What is being done, with the seconds that it has taken once they are many."""
        seconds = 0 if self.job is None else int(time.monotonic() - self.job.begun)
        return f"{self.stage}, {seconds} s" if seconds >= LONG else self.stage

    @property
    def fraction(self) -> float:
        """The share that is done, 0..1."""
        return 0.0 if self.job is None else self.job.fraction

    def start(self, work: Work) -> None:
        """Compute ``work`` in a thread."""
        self.work, self.job = work, Job(work.compute)

    def cancel(self) -> None:
        """Ask the work to stop; without a thread it leaves the queue."""
        if self.job is not None:
            self.job.cancel()
        else:
            self.is_dropped = True
            lane = _lanes[self.beside]
            if self in lane.waiting:
                lane.waiting.remove(self)

    @property
    def is_stopping(self) -> bool:
        """Whether :meth:`cancel` was called."""
        return self.is_dropped or (self.job is not None and self.job.is_stopping)

    def finish(self) -> bool:
        """Write the result and return True; False if what is wanted has changed meanwhile.

        Then that is being computed. Raises what reading, computing or writing raised, Cancelled
        after :meth:`cancel`.
        """
        assert self.job is not None and self.work is not None
        result = self.job.result()
        wanted = self.read()
        if wanted is not None and wanted.key != self.work.key:
            self.start(wanted)
            return False
        if wanted is not None:
            wanted.write(result)
        return True


class Lane:
    """Entries that are computed one after another.

    Attributes
    ----------
    waiting : those that are yet to be begun, first to last
    running : the one that is computed
    """

    def __init__(self) -> None:
        self.waiting: list[Entry] = []
        self.running: Entry | None = None

    @property
    def entries(self) -> list[Entry]:
        """All of them, first to last."""
        return [*self.waiting] if self.running is None else [self.running, *self.waiting]


_lanes = (Lane(), Lane())
"""For work in this process, and for that of others: an entry's ``beside`` picks one."""

_used = 0.0
"""When something was last computed, of time.monotonic."""


def is_immediate() -> bool:
    """Whether work is done at once, because there is no window whose user would wait."""
    return bool(bpy.app.background)


def put(entry: Entry, first: bool = False) -> Entry:
    """Add an entry, at the end or before all others, and return it."""
    note_use()
    waiting = _lanes[entry.beside].waiting
    waiting.insert(0 if first else len(waiting), entry)
    if not bpy.app.timers.is_registered(tick):
        bpy.app.timers.register(tick, first_interval=TICK, persistent=True)
    return entry


def running() -> Entry | None:
    """Return what is being computed now in this process."""
    return _lanes[False].running


def is_waiting() -> bool:
    """Whether something waits to be begun."""
    return any(lane.waiting for lane in _lanes)


def is_busy() -> bool:
    """Whether something is computed, or waits for that."""
    return any(lane.entries for lane in _lanes)


def note_use() -> None:
    """Note that something is being computed."""
    global _used
    _used = time.monotonic()


def last_used() -> float:
    """Return when something was last computed, of time.monotonic; 0 for never."""
    return _used


def collecting(beside: bool = False) -> Entry | None:
    """Return what an operator waits for: running, or still waiting."""
    return next((entry for entry in _lanes[beside].entries if entry.collected), None)


def entry_of(owner: int) -> Entry | None:
    """Return the entry of an object, if it has one that no operator waits for."""
    entries = [entry for lane in _lanes for entry in lane.entries]
    return next((entry for entry in entries if entry.owner == owner and not entry.collected), None)


def collect(entry: Entry) -> bool:
    """Have an operator write its entry's result; return whether it is done, see Entry.finish."""
    done = True
    try:
        done = entry.finish()
    finally:
        if done:
            _release(entry)
    return done


def drop(entry: Entry) -> None:
    """Stop an entry and forget it, whatever becomes of its thread."""
    entry.cancel()
    _release(entry)


def _release(entry: Entry) -> None:
    """Let the next entry of its lane begin."""
    note_use()
    lane = _lanes[entry.beside]
    if lane.running is entry:
        lane.running = None


def run_now(entry: Entry) -> None:
    """Do an entry's work at once, in this thread; errors go to ``entry.fail``."""
    try:
        work = entry.read()
        if work is not None:
            work.write(work.compute(silent))
            note_use()
    except Exception as error:
        report_failure(entry, error)


def report_failure(entry: Entry, error: Exception) -> None:
    """Tell an entry of its error; what is no sentence for users goes to the console as well."""
    print_unexpected(error)
    entry.error = error
    entry.fail(error)


def print_unexpected(error: Exception) -> None:
    """Print what is no sentence for users to the console, with where it happened."""
    if not (isinstance(error, (ValueError, ImportError)) or is_no_memory(error)):
        with contextlib.suppress(OSError, ValueError):  # a console that goes to a full disk
            traceback.print_exception(error)


def drop_abandoned() -> None:
    """Drop what an operator was to write whose window was closed: Blender does not tell it."""
    waited_for = [entry for lane in _lanes for entry in lane.entries if entry.collected]
    if not waited_for:
        return
    there = {window.as_pointer() for window in bpy.context.window_manager.windows}
    for entry in waited_for:
        if entry.window and entry.window not in there:
            drop(entry)


def tick() -> float | None:
    """Write what is done and begin what waits; None ends the timer."""
    drop_abandoned()
    redraw_sidebars()
    if is_locked():
        return TICK
    main_thread.do_requests()
    for lane in _lanes:
        entry = lane.running
        if entry is not None and entry.is_ready and not entry.collected:
            _end(lane, entry)
    begin()
    is_busy = main_thread.is_asked() or any(lane.entries for lane in _lanes)
    return TICK if is_busy else None


def begin() -> None:
    """Begin what waits wherever nothing runs; write nothing. What was stopped gives way.

    Undo has all splashes looked at: where there are many, the next tick goes on.
    """
    end = time.monotonic() + SLICE
    for lane in _lanes:
        entry = lane.running
        if entry is not None and entry.is_stopping and entry.is_ready and not entry.collected:
            lane.running = None
        while lane.running is None and lane.waiting:
            _begin(lane, lane.waiting.pop(0))
            if time.monotonic() > end:
                break


def _end(lane: Lane, entry: Entry) -> None:
    """End what was computed, unless something else is wanted of it by now."""
    from ...core.progress import Cancelled

    done = True
    try:
        done = entry.finish()
    except Cancelled:
        pass
    except Exception as error:
        report_failure(entry, error)
    if done:
        note_use()
        lane.running = None


def _begin(lane: Lane, entry: Entry) -> None:
    try:
        work = entry.read()
        if work is not None:
            lane.running = entry
            entry.start(work)
    except Exception as error:
        lane.running = None
        report_failure(entry, error)


def stop(seconds: float = STOP_SECONDS) -> None:
    """Empty the queue, and wait for the threads."""
    running = [lane.running for lane in _lanes if lane.running is not None]
    for lane in _lanes:
        for entry in lane.entries:
            entry.is_dropped = True
        lane.waiting.clear()
        lane.running = None
    jobs = [entry.job for entry in running if entry.job is not None]
    for job in jobs:
        job.cancel()
    for job in jobs:
        job.wait(seconds)


@bpy.app.handlers.persistent
def before_another_file(_file: object = None, _unused: object = None) -> None:
    """Forget everything: its objects are going. The thread ends at its next report."""
    stop(0.0)


def register() -> None:
    """Listen to files being opened."""
    bpy.app.handlers.load_pre.append(before_another_file)


def unregister() -> None:
    """Stop what is running."""
    bpy.app.handlers.load_pre.remove(before_another_file)
    if bpy.app.timers.is_registered(tick):
        bpy.app.timers.unregister(tick)
    stop()
