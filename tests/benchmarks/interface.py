# SPDX-License-Identifier: GPL-3.0-or-later
"""What the interface costs among many objects, as a multiple of what it costs among few.

It runs in a process of its own, as Blender holds one file at a time.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import timeit
from collections.abc import Callable

from tests.benchmarks.window import ROOT, in_second_window

FEW, MANY = 8, 8000
"""Objects beside the splash."""

REPEATS = 15
"""Of each measurement, the fastest of which counts."""


def measure() -> dict[str, float]:
    """Return this area's numbers."""
    command = [sys.executable, "-m", "tests.benchmarks.interface"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return {**json.loads(done.stdout.splitlines()[-1]), **in_a_window()}


def in_a_window() -> dict[str, float]:
    """Return how long the interface is held up; nothing where no Blender has a window."""
    return in_second_window("interface_window.py")


def milliseconds(call: Callable[[], object], number: int) -> float:
    """Return the milliseconds of processor time that a call takes: others may use the machine."""
    seconds = timeit.repeat(call, number=number, repeat=REPEATS, timer=time.process_time)
    return 1000 * min(seconds) / number


def measured() -> dict[str, float]:
    """Measure in this process, with few objects and then with many."""
    import bpy

    import liquid_splash_addon
    from liquid_splash_addon.blender.data import index
    from tests.blender.drawing_panels import add_objects, draw_all
    from tests.blender.sketching import add_sketch, fan

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    liquid_splash_addon.register()
    sketch = add_sketch(fan())
    splash = bpy.data.objects.new("Splash", bpy.data.meshes.new("Splash"))
    bpy.context.scene.collection.objects.link(splash)
    splash.splash.sketch, splash.splash.version = sketch, "benchmark"

    def notice() -> None:
        """Do what the add-on does after every change of the scene."""
        graph = bpy.context.evaluated_depsgraph_get()
        for handler in bpy.app.handlers.depsgraph_update_post:
            handler(bpy.context.scene, graph)

    found: dict[str, dict[int, float]] = {}
    for count, added in ((FEW, FEW), (MANY, MANY - FEW)):
        add_objects(added)
        draw_all()
        for name, value in (
            ("panel_draw_ms", milliseconds(draw_all, 20)),
            ("handler_ms", milliseconds(notice, 100)),
            ("search_ms", milliseconds(index.scan, 1)),
        ):
            found.setdefault(name, {})[count] = value
    numbers = {
        f"interface.{name}_{count}": value
        for name, values in found.items()
        for count, value in values.items()
    }
    drawn = found["panel_draw_ms"]
    numbers[f"interface.panel_draw_ms_{MANY}_over_{FEW}"] = drawn[MANY] / drawn[FEW]
    return numbers


if __name__ == "__main__":
    print(json.dumps(measured()), flush=True)
    os._exit(0)  # Blender's module may crash while Python ends
