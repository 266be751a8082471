# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_first_sketch.py in a Blender with a window: what a beginner does, with one click.

Eight quick strokes, flat, drawn with the mouse in the view that Blender starts with, then *Generate
Splash*, with the shipped weights. Words after ``--``: nothing, or a folder for a picture of the
window and the file, which ``scripts/make_start.py --file`` renders.
"""

import math
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import work_queue
from tests.blender.first_sketch_window import (
    PICTURES,
    TICK,
    Path2D,
    clear,
    draw_with_mouse,
    press,
    show,
    strokes,
)
from tests.blender.running_scripts import Condition, run
from tests.blender.sketching import splashes

STROKES = 8

SECONDS = 0.5
"""That a stroke takes. The first has Blender compile shaders: its hand is half as fast."""


def stroke(number: int) -> Path2D:
    """Return one of the strokes of a fan: out of a place, up and outwards, then bent down."""
    angle = math.radians(25 + 130 * number / (STROKES - 1))
    length = 150 + 25 * math.sin(3 * number)

    def path(share: float) -> tuple[float, float]:
        share = min(share, 1.1)
        fall = 60 * share**2 * (0.4 + abs(math.cos(angle)))
        across, up = length * share * math.cos(angle), length * share * math.sin(angle)
        return across, -110 + 1.5 * up - fall

    return path


def is_idle() -> bool:
    """Whether nothing is left to do."""
    return work_queue.running() is None and not work_queue.is_waiting()


def fan_with_the_mouse() -> Iterator[Condition]:
    """Draw, click once, and check that what stands there is a refined splash on its strokes."""
    clear()
    press("splash.new_sketch")
    yield lambda: bpy.context.active_object.mode == "PAINT_GREASE_PENCIL"
    for number in range(STROKES):
        yield from draw_with_mouse(stroke(number), SECONDS if number else 2 * SECONDS)
    assert len(strokes()) == STROKES
    assert press("splash.generate") == {"RUNNING_MODAL"}
    yield lambda: work_queue.collecting() is None and is_idle()
    yield is_idle
    (splash,) = splashes()
    stack = splash.splash_stack
    assert [item.kind for item in stack.items] == ["DROPLETS", "SHEETS", "WAVES"]
    assert not stack.pending and not stack.warnings, stack.warnings
    assert not splash.splash.warnings, splash.splash.warnings
    yield from show("first_flat")
    bpy.ops.object.mode_set(mode="OBJECT")
    if PICTURES is not None:
        bpy.ops.wm.save_as_mainfile(filepath=str(PICTURES / "first_flat.blend"))


if __name__ == "__main__":
    liquid_splash_addon.register()
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.system.viewport_aa = "OFF"  # the processor draws: let it draw less
    script = run(fan_with_the_mouse(), pause=TICK)
    bpy.app.timers.register(script, first_interval=1.0, persistent=True)
