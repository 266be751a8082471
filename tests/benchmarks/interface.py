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
from typing import Any

from tests.benchmarks.window import ROOT, in_second_window

FEW, MANY = 8, 8000
"""Objects beside the splash."""

SPLASHES = 50
"""In the file of which undo is measured, beside MANY objects."""

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
    numbers |= undo(sketch)
    drawn = found["panel_draw_ms"]
    numbers[f"interface.panel_draw_ms_{MANY}_over_{FEW}"] = drawn[MANY] / drawn[FEW]
    return numbers


def undo(sketch: Any) -> dict[str, float]:
    """Return the milliseconds of ours in one Ctrl+Z while drawing, among many splashes.

    sketch : of the scene, with strokes; also the longest piece of what follows in timers.
    """
    import bpy

    from liquid_splash_addon.blender.jobs import loaded_generator, staleness, work_queue
    from tests.blender.sketching import TubeGenerator, generate

    loaded_generator.get = lambda *_: TubeGenerator()  # type: ignore[assignment]
    bpy.context.view_layer.objects.active = sketch
    for item in [item for item in bpy.data.objects if item.name.startswith("Splash")]:
        bpy.data.objects.remove(item)
    splash = generate()
    for _ in range(SPLASHES - 1):
        copy = splash.copy()
        copy.data = splash.data.copy()
        bpy.context.scene.collection.objects.link(copy)
    work_queue.is_immediate = lambda: False
    spent, name = [0.0], sketch.name  # undo makes it another object
    lists = ("undo_pre", "undo_post", "depsgraph_update_pre", "depsgraph_update_post")
    for listed in (getattr(bpy.app.handlers, name) for name in lists):
        listed[:] = [timed(handler, spent) for handler in listed]
    undone, pieces = [], []
    for number in range(REPEATS):
        bpy.ops.ed.undo_push(message="Before")
        bpy.data.objects[name].location.x += 0.01
        bpy.context.view_layer.update()
        bpy.ops.ed.undo_push(message=f"Stroke {number}")
        spent[0] = 0.0
        bpy.ops.ed.undo()
        bpy.context.view_layer.update()
        undone.append(spent[0])
        for tick in (work_queue.tick, staleness.look_later):
            begun = time.process_time()
            while tick() is not None:
                pieces.append(time.process_time() - begun)
                begun = time.process_time()
    return {
        f"interface.undo_ms_{MANY}_{SPLASHES}": 1000 * min(undone),
        f"interface.undo_piece_ms_{MANY}_{SPLASHES}": 1000 * max(pieces, default=0.0),
    }


def timed(handler: Callable[..., object], spent: list[float]) -> Callable[..., object]:
    """Return a handler that adds the seconds of processor time that it takes to ``spent``."""

    def call(*arguments: object) -> None:
        begun = time.process_time()
        handler(*arguments)
        spent[0] += time.process_time() - begun

    return call


if __name__ == "__main__":
    print(json.dumps(measured()), flush=True)
    os._exit(0)  # Blender's module may crash while Python ends
