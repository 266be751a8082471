# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by interface.py in a Blender with a window: how long the interface is held up.

Its one argument after ``--`` is the folder for compiled code, as an extension has one.

Two things hold it up: what the add-on does in Blender's own thread, and whoever holds Python's
lock meanwhile. Both are watched while a splash is made and refined at full resolution: first in a
process that has imported nothing yet, then again, then while another process compiles. Imports of
libraries are told apart from the rest.
"""

from __future__ import annotations

import builtins
import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import scheduler, work_queue
from liquid_splash_addon.blender.ui.queued_operator import QueuedOperator
from liquid_splash_addon.core import compiled_code, packages
from liquid_splash_addon.core.sketch.presets import example_sketch
from tests.blender.running_scripts import Condition, run
from tests.blender.sketching import add_sketch
from tests.blender.window_script import idle, press

NAP = 0.001
"""Seconds between two looks at Python's lock."""

BUSY = "import numba\nfor n in range(400):\n    numba.njit(lambda x: x * n + 1)(float(n))\n"
"""What the other process does: it compiles."""


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


WATCH = Watch(Imports())


def watch_our_calls() -> None:
    """Watch what the add-on does in Blender's own thread: its operators and the queue's timer."""
    invoke, modal = (WATCH.timed(getattr(QueuedOperator, name)) for name in ("invoke", "modal"))
    # Blender passes as many arguments as a function names.
    QueuedOperator.invoke = lambda operator, context, event: invoke(operator, context, event)
    QueuedOperator.modal = lambda operator, context, event: modal(operator, context, event)
    work_queue.tick = WATCH.timed(work_queue.tick)
    scheduler.request = WATCH.timed(scheduler.request)


def splash_and_refinements() -> Iterator[Condition]:
    """Make a splash of the crown at full resolution and refine it by the Fresh list."""
    with WATCH.pressing():
        press("splash.generate")
    yield idle
    window = bpy.context.window_manager.windows[0]
    with WATCH.pressing(), bpy.context.temp_override(window=window):
        bpy.ops.splash.refinement_preset("EXEC_DEFAULT", True, preset="FRESH")
    yield is_quiet
    splash = bpy.context.active_object
    splash.splash_stack.items[0].droplets.amount = 0.004
    yield is_quiet
    splash.splash_stack.items[2].waves.amplitude = 0.001
    yield is_quiet


def is_quiet() -> bool:
    """Whether the queue is empty."""
    return work_queue.running() is None and not work_queue.is_waiting()


def measured() -> Iterator[Condition]:
    """Measure, and print the numbers."""
    numbers: dict[str, float] = {}
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    bpy.context.scene.splash.settings.resolution = "128"
    add_sketch(example_sketch())
    begin = time.perf_counter()
    WATCH.start_anew()
    press("splash.generate")
    yield idle
    numbers["interface.first_splash_seconds"] = time.perf_counter() - begin
    numbers["interface.first_splash_imports_seconds"] = WATCH.imports.seconds
    numbers["interface.first_splash_stall_ms"] = max(WATCH.lock, WATCH.call)
    numbers["interface.import_stall_ms"] = WATCH.importing
    yield is_quiet
    numbers["interface.first_refined_seconds"] = time.perf_counter() - begin
    print(f"first splash: lock {WATCH.lock:.1f}, {WATCH.name} {WATCH.call:.1f}", flush=True)
    yield from splash_and_refinements()  # what is imported for refinements is imported by now
    for name in ("longest_stall_ms", "longest_stall_ms_while_compiling"):
        other = subprocess.Popen([sys.executable, "-c", BUSY]) if "compiling" in name else None
        WATCH.start_anew()
        yield from splash_and_refinements()
        numbers[f"interface.{name}"] = max(WATCH.lock, WATCH.call)
        print(f"{name}: lock {WATCH.lock:.1f}, {WATCH.name} {WATCH.call:.1f}", flush=True)
        if other is not None:
            other.kill()
    print("numbers:", json.dumps(numbers), flush=True)


if __name__ == "__main__":
    compiled_code.keep_below(Path(sys.argv[-1]))
    liquid_splash_addon.register()
    watch_our_calls()
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(run(measured()), first_interval=1.0, persistent=True)
