# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by product.py in a Blender with a window: the first splash of a process, and another.

Its one argument after ``--`` is the folder for compiled code, as an extension has one; where it is
empty, nothing was compiled before. The splash is asked for the moment that the tab is shown, so
compiling ahead has no lead.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import tests.benchmarks.kept_code  # noqa: F401, I001 (first)

import bpy

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import work_queue
from liquid_splash_addon.core.sketch.presets import example_sketch
from tests.benchmarks.watching import Imports, Watch, watch_our_calls
from tests.blender.running_scripts import Condition, run, show_tab
from tests.blender.sketching import add_sketch
from tests.blender.window_script import idle, press

LOOK = 0.05
"""Seconds between two looks at the line of progress."""

WATCH = Watch(Imports())


class Line:
    """The line of progress: how long it has stood still at most, in seconds."""

    def __init__(self) -> None:
        self.still, self.shown, self.since = 0.0, None, time.perf_counter()

    def is_done(self) -> bool:
        """Whether the splash is there; to be called all the time."""
        entry, now = work_queue.running(), time.perf_counter()
        shown = None if entry is None else (entry.line, entry.fraction)
        self.still = max(self.still, now - self.since)
        if shown != self.shown:
            self.shown, self.since = shown, now
        return idle()


def measured() -> Iterator[Condition]:
    """Measure, and print the numbers."""
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    sketch = add_sketch(example_sketch())
    yield show_tab
    numbers: dict[str, float] = {}
    WATCH.start_anew()
    line, begin = Line(), time.perf_counter()
    press("splash.generate")
    yield line.is_done
    seconds = time.perf_counter() - begin
    print(f"first: {WATCH.name} {WATCH.call:.1f}, lock {WATCH.lock:.1f}", flush=True)
    numbers["first_splash_seconds"] = seconds
    numbers["new_blender_seconds"] = seconds - WATCH.imports.seconds
    numbers["first_progress_still_seconds"] = line.still
    numbers["first_stall_ms"] = max(WATCH.lock, WATCH.call)
    bpy.context.view_layer.objects.active = sketch
    begin = time.perf_counter()
    press("splash.generate")
    yield idle
    numbers["again_seconds"] = time.perf_counter() - begin
    print("numbers:", json.dumps(numbers), flush=True)


if __name__ == "__main__":
    liquid_splash_addon.register()
    watch_our_calls(WATCH)
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(run(measured(), pause=LOOK), first_interval=1.0, persistent=True)
