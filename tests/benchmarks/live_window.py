# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by capture.py in a Blender with a window: how soon a draft follows the pen.

Its one argument after ``--`` is the folder for compiled code. Strokes are drawn with the mouse in
Draw mode; the clock runs from the button's release until the draft is in the mesh and the viewport
was drawn again. The viewport is smoothed over eight drawings, which a processor takes two seconds
for, and a graphics card none: that is switched off.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import tests.benchmarks.kept_code  # noqa: F401, I001 (first)

import bpy

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import draft_then_full, generate, live
from liquid_splash_addon.core.sketch.presets import example_sketch
from tests.benchmarks.interface_window import WATCH
from tests.blender.live_window import at_rest
from tests.blender.running_scripts import Condition, run
from tests.blender.sketching import add_sketch

STROKES = 7
"""That are drawn; the median counts."""

POINTS = 24
"""Of a stroke, as the mouse gives them."""

SIZE = 0.25
"""Of the splash, metres: there is room for strokes beside it."""

NUDGED = 30
"""Pixels between two strokes."""

written: list[float] = []
drawn: list[float] = []


def note_writing(write: Any) -> Any:
    """Return a writer that says when it was done."""

    def noting(*inputs: Any) -> Any:
        found = write(*inputs)
        written.append(time.perf_counter())
        return found

    return noting


def note_drawing() -> None:
    """Say when the viewport was drawn."""
    drawn.append(time.perf_counter())


def mouse(kind: str, value: str, x: int, y: int) -> None:
    """Send an event of the mouse."""
    bpy.context.window_manager.windows[0].event_simulate(kind, value, x=x, y=y)


def stroke(number: int) -> Iterator[Condition]:
    """Draw a stroke over the middle of the viewport."""
    window = bpy.context.window_manager.windows[0]
    x, y = window.width // 3, window.height // 3 + NUDGED * number
    mouse("MOUSEMOVE", "NOTHING", x, y)
    mouse("LEFTMOUSE", "PRESS", x, y)
    for point in range(POINTS):
        mouse("MOUSEMOVE", "NOTHING", x + 4 * point, y + point)
        yield lambda: True
    mouse("LEFTMOUSE", "RELEASE", x + 4 * POINTS, y + POINTS)


def drafted_after(moment: float) -> Condition:
    """Wait until a draft was written after ``moment``, and the viewport drawn after that."""
    return lambda: any(at > moment and any(seen > at for seen in drawn[-5:]) for at in written[-1:])


def measured() -> Iterator[Condition]:
    """Measure, and print the numbers."""
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    bpy.context.scene.splash.settings.resolution = "128"
    bpy.context.scene.splash.settings.real_size = SIZE
    sketch = add_sketch(example_sketch())
    bpy.ops.object.mode_set(mode="PAINT_GREASE_PENCIL")
    bpy.context.scene.splash.live = True
    strokes = len(sketch.data.layers[0].current_frame().drawing.strokes)
    live.notice()
    yield lambda: bool(written) and at_rest()
    seconds, watch = [], WATCH
    for number in range(STROKES):
        yield from stroke(number)
        released = time.perf_counter()
        yield drafted_after(released)
        seconds.append(next(seen for seen in drawn if seen > written[-1]) - released)
        if number == 0:
            watch.start_anew()  # what is loaded with the first of them was loaded
        yield at_rest
    layer = next(item for item in sketch.data.layers)
    assert len(layer.current_frame().drawing.strokes) == strokes + STROKES, "nothing was drawn"
    print("each:", [round(value, 2) for value in seconds], draft_then_full.making().stage)
    numbers = {
        "capture.live_seconds": statistics.median(seconds),
        "capture.live_stall_ms": watch.lock,
    }
    print("numbers:", json.dumps(numbers), flush=True)


if __name__ == "__main__":
    liquid_splash_addon.register()
    generate.write = note_writing(generate.write)
    bpy.types.SpaceView3D.draw_handler_add(note_drawing, (), "WINDOW", "POST_VIEW")
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.system.viewport_aa = "OFF"
    bpy.app.timers.register(
        run(measured(), pause=0.02, explain=lambda: print(live.said())),
        first_interval=1.0,
        persistent=True,
    )
