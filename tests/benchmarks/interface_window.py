# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by interface.py in a Blender with a window: how long the interface is held up.

Its one argument after ``--`` is the folder for compiled code, as an extension has one.

Two things hold it up: what the add-on does in Blender's own thread, and whoever holds Python's
lock meanwhile. Both are watched while a splash is made and refined at full resolution: first in a
process that has imported nothing yet, then again, then while another process compiles. Imports of
libraries are told apart from the rest.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import tests.benchmarks.kept_code  # noqa: F401, I001 (first)

import bpy

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import compile_ahead, work_queue
from liquid_splash_addon.core.sketch.presets import example_sketch
from tests.benchmarks.watching import Imports, Watch, watch_our_calls
from tests.blender.running_scripts import Condition, run
from tests.blender.sketching import add_sketch
from tests.blender.window_script import idle, press

BUSY = "import numba\nfor n in range(400):\n    numba.njit(lambda x: x * n + 1)(float(n))\n"
"""What the other process does: it compiles."""


WATCH = Watch(Imports())


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
    # The next Blender is one in which all was compiled before.
    yield lambda: compile_ahead.running() is None
    print("numbers:", json.dumps(numbers), flush=True)


if __name__ == "__main__":
    liquid_splash_addon.register()
    watch_our_calls(WATCH)
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(run(measured()), first_interval=1.0, persistent=True)
