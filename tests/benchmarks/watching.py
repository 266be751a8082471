# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds up the interface of a Blender with a window: our own calls, and Python's lock.

Imports of libraries are told apart from the rest.
"""

from __future__ import annotations

import builtins
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from liquid_splash_addon.blender.jobs import scheduler, work_queue
from liquid_splash_addon.blender.ui.queued_operator import QueuedOperator
from liquid_splash_addon.core import packages

NAP = 0.001
"""Seconds between two looks at Python's lock."""


class Imports:
    """Imports in threads other than Blender's own: how long they take, and whether one runs."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.depth = 0
        builtins.__import__ = self.watched(builtins.__import__)
        # The first part of importing torch.
        packages.preload_torch = self.watched(packages.preload_torch)

    def watched(self, importing: Callable[..., Any]) -> Callable[..., Any]:
        """Return ``importing``, with the time taken of what is not within another import."""

        def timed(*inputs: Any, **options: Any) -> Any:
            if threading.current_thread() is threading.main_thread():
                return importing(*inputs, **options)
            begin = time.perf_counter()
            self.depth += 1
            try:
                return importing(*inputs, **options)
            finally:
                self.depth -= 1
                if not self.depth:
                    self.seconds += time.perf_counter() - begin

        return timed


class Watch:
    """The longest that Python's lock was held, and that one of our calls took, in milliseconds.

    Attributes
    ----------
    lock, importing : by what is ours, and by imports
    call, name : the longest call, and which it was
    """

    def __init__(self, imports: Imports) -> None:
        self.lock = self.importing = self.call = 0.0
        self.name = ""
        self.presses = 0
        self.imports = imports
        threading.Thread(target=self.look, daemon=True).start()

    def look(self) -> None:
        """Sleep for a moment, again and again: what is slept longer is waited for the lock."""
        while True:
            begin, presses, imported = time.perf_counter(), self.presses, self.imports.seconds
            time.sleep(NAP)
            taken = 1000 * (time.perf_counter() - begin - NAP)
            if self.imports.depth or 1000 * (self.imports.seconds - imported) > taken / 2:
                self.importing = max(self.importing, taken)
            # A press by a script holds the lock for Blender's undo step too; a user's does not.
            elif presses == self.presses and presses % 2 == 0:
                self.lock = max(self.lock, taken)

    @contextmanager
    def pressing(self) -> Iterator[None]:
        """Leave out what Blender does within the block, but not what the add-on does."""
        self.presses += 1
        try:
            yield
        finally:
            self.presses += 1

    def timed(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that is watched."""

        def watched(*inputs: Any, **options: Any) -> Any:
            begin = time.perf_counter()
            try:
                return function(*inputs, **options)
            finally:
                taken = 1000 * (time.perf_counter() - begin)
                if taken > self.call:
                    self.call, self.name = taken, function.__qualname__

        return watched

    def start_anew(self) -> None:
        """Forget what was seen."""
        self.lock = self.importing = self.call = 0.0


def watch_our_calls(watch: Watch) -> None:
    """Watch what the add-on does in Blender's own thread: its operators and the queue's timer."""
    invoke, modal = (watch.timed(getattr(QueuedOperator, name)) for name in ("invoke", "modal"))
    # Blender passes as many arguments as a function names.
    QueuedOperator.invoke = lambda operator, context, event: invoke(operator, context, event)
    QueuedOperator.modal = lambda operator, context, event: modal(operator, context, event)
    work_queue.tick = watch.timed(work_queue.tick)
    scheduler.request = watch.timed(scheduler.request)
