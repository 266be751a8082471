# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_first_sketch.py in a Blender with a window: a first sketch, drawn with the mouse.

Words after ``--``: nothing, or a folder for pictures of each step, for which the splash is made by
the real weights.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np
from bpy_extras.view3d_utils import region_2d_to_location_3d
from mathutils import Euler

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import loaded_generator, speed_map, work_queue
from liquid_splash_addon.blender.scene.grease_pencil import (
    drawn_strokes,
    has_strokes,
    read_drawings,
)
from liquid_splash_addon.blender.ui import speed_overlay
from liquid_splash_addon.core.condition.trained_range import FAST
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from tests.blender.running_scripts import Condition, run
from tests.blender.sketching import TubeGenerator, add_sketch, fan, splashes

PICTURES = Path(sys.argv[-1]).resolve() if sys.argv[-1] != "--" else None

TICK = 0.02
"""Seconds between two events of the mouse, if Blender is not busy."""

SECONDS = 0.6 if PICTURES is None else 3.0
"""That a stroke of a crown takes. For pictures it is drawn more slowly, for more events than a
processor that draws the viewport leaves time for, and the liquid is as much faster (GAIN)."""

GAIN = 20.0

Path2D = Callable[[float], tuple[float, float]]
"""Where the mouse is, in pixels of the viewport from its middle, at a share of a stroke."""


def viewport() -> tuple[Any, Any, Any]:
    """Return window, area and region of the 3D viewport."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    return window, area, next(r for r in area.regions if r.type == "WINDOW")


def press(name: str, /, **options: object) -> set[str]:
    """Run an operator as its button does, in the 3D viewport."""
    window, area, region = viewport()
    with bpy.context.temp_override(window=window, area=area, region=region):
        space, operator = name.split(".")
        return getattr(getattr(bpy.ops, space), operator)("INVOKE_DEFAULT", True, **options)


def look(kind: str = "FRONT") -> None:
    """Look along an axis, without perspective, and show nothing but the scene."""
    window, area, region = viewport()
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.view3d.view_axis(type=kind)
    space = area.spaces.active
    space.region_3d.view_perspective = "ORTHO"
    space.region_3d.view_location = (0, 0, 0.35)
    space.region_3d.view_distance = 4.0


def turn() -> None:
    """Look from above and from the side, for a picture."""
    if PICTURES is not None:
        view = viewport()[1].spaces.active.region_3d
        view.view_rotation = Euler((1.15, 0.0, 0.5)).to_quaternion()
        view.view_location = (0, 0, 0.25)


def move(kind: str, value: str, place: tuple[float, float], **keys: bool) -> None:
    """Send an event of the mouse, in pixels from the middle of the viewport."""
    window, _, region = viewport()
    x, y = (round(offset) for offset in place)
    middle = region.x + region.width // 2, region.y + region.height // 2
    window.event_simulate(kind, value, x=middle[0] + x, y=middle[1] + y, **keys)


def draw_with_mouse(path: Path2D, seconds: float, after: int | None = None) -> Iterator[Condition]:
    """Draw a stroke in so many seconds: where the hand is, the clock says.

    after : strokes that are there before
    """
    count = len(strokes()) if after is None else after
    move("MOUSEMOVE", "NOTHING", path(0.0))
    yield lambda: True
    move("LEFTMOUSE", "PRESS", path(0.0))
    begin = time.perf_counter()
    while (share := (time.perf_counter() - begin) / seconds) < 1:
        move("MOUSEMOVE", "NOTHING", path(share))
        yield lambda: True
    # A busy machine is late: the hand has gone on meanwhile. Not so in pictures.
    share = share if PICTURES is None else 1.0
    move("MOUSEMOVE", "NOTHING", path(share))
    move("LEFTMOUSE", "RELEASE", path(share))
    yield lambda: len(strokes()) > count
    yield lambda: True


def strokes() -> list:
    """Return the strokes of the active sketch's first layer."""
    layer = bpy.context.active_object.data.layers[0]
    return list(drawn_strokes(layer)) if has_strokes(layer) else []


def world_of(place: tuple[float, float]) -> np.ndarray:
    """Return where a pixel, from the middle of the viewport, lies in the plane of the cursor."""
    _, area, region = viewport()
    pixel = (region.width // 2 + place[0], region.height // 2 + place[1])
    cursor = bpy.context.scene.cursor.location
    return np.array(region_2d_to_location_3d(region, area.spaces.active.region_3d, pixel, cursor))


def show(name: str) -> Iterator[Condition]:
    """Keep a picture of the window. Blender's own screenshot is black where a processor draws."""
    if PICTURES is None:
        return
    for _ in range(20):
        yield lambda: True
    path = PICTURES / f"{name}.png"
    subprocess.run(["import", "-window", "root", str(path)], check=True)


def tall(share: float) -> tuple[float, float]:
    """A profile of a crown: out of a ring, up and outwards."""
    return 45 + 110 * share**1.3, -60 + 150 * np.sin(min(share, 1.2) * np.pi / 2)


def low(share: float) -> tuple[float, float]:
    """A lower one, drawn beside it."""
    return 35 + 105 * share**1.2, -60 + 90 * np.sin(min(share, 1.2) * np.pi / 2)


def across(height: float) -> Path2D:
    """A straight stroke at a height."""
    return lambda share: (-150 + 300 * share, height)


def first_crown() -> Iterator[Condition]:
    """New Sketch, two strokes, Spin, Generate Splash."""
    clear()
    look()
    yield lambda: True
    yield from show("empty")
    assert press("splash.new_sketch") == {"FINISHED"}
    yield lambda: bpy.context.active_object.mode == "PAINT_GREASE_PENCIL"
    yield from show("new_sketch")
    for number, (path, seconds) in enumerate(((tall, SECONDS), (low, SECONDS)), start=1):
        yield from draw_with_mouse(path, seconds)
        assert len(strokes()) == number, f"{len(strokes())} strokes"
        drawn = strokes()[-1]
        start = world_of(path(0.0))
        assert np.linalg.norm(drawn.points[0] - start) < 0.1, (drawn.points[0], start)
        assert drawn.points[-1, 2] > drawn.points[0, 2] + 0.3, "it goes up"
        assert np.ptp(drawn.times) > 0.6 * seconds, np.ptp(drawn.times)
    yield from show("strokes")
    assert press("splash.stroke_spin", count=12) == {"FINISHED"}
    yield lambda: True
    assert len(strokes()) == 12
    assert bpy.context.active_object.mode == "PAINT_GREASE_PENCIL"
    turn()
    yield from show("spin")
    press("ed.undo")
    assert len(strokes()) == 2, "one undo step"
    press("ed.redo")
    assert len(strokes()) == 12
    assert press("splash.generate") == {"RUNNING_MODAL"}
    yield lambda: work_queue.collecting() is None
    assert len(splashes()) == 1
    yield from show("splash")


def slow_and_fast() -> Iterator[Condition]:
    """The same stroke twice, one four times as fast. The one before has Blender compile shaders."""
    clear()
    look()
    press("splash.new_sketch")
    yield lambda: bpy.context.active_object.mode == "PAINT_GREASE_PENCIL"
    for height, seconds in ((-80, 1.0), (-40, 8.0), (40, 2.0)):
        yield from draw_with_mouse(across(height), seconds)
    drawings = read_drawings(bpy.context.active_object)[0][1:]
    assert len(drawings) == 2
    found, warnings = strokes_from_drawings(drawings, SplashSettings(real_size=0.0))
    assert not warnings
    slow, fast = (np.median(np.linalg.norm(s.velocities, axis=1)) for s in found)
    seconds = [float(np.ptp(drawing.times)) for drawing in drawings]
    print(f"fast over slow: {fast / slow:.3f} of 4; drawn in {seconds} s", flush=True)
    assert abs(fast / slow / 4 - 1) < 0.1, (slow, fast, seconds)


def by_tool_and_shortcut() -> Iterator[Condition]:
    """The toolbar's tool draws its first stroke at once; the shortcut begins a sketch."""
    clear()
    look()
    press("wm.tool_set_by_id", name="splash.sketch")
    yield lambda: True
    yield from draw_with_mouse(tall, 0.6, after=0)
    active = bpy.context.active_object
    assert active.type == "GREASEPENCIL" and active.mode == "PAINT_GREASE_PENCIL"
    assert len(strokes()) == 1, f"{len(strokes())} strokes"
    bpy.ops.object.mode_set(mode="OBJECT")
    press("wm.tool_set_by_id", name="builtin.select_box")
    yield lambda: True
    move("MOUSEMOVE", "NOTHING", (0, 0))
    yield lambda: True
    for value in ("PRESS", "RELEASE"):
        move("W", value, (0, 0), shift=True, alt=True)
    yield lambda: bpy.context.active_object not in (None, active)
    assert bpy.context.active_object.mode == "PAINT_GREASE_PENCIL"


def undo_in_edit_mode() -> Iterator[Condition]:
    """A tool is one undo step in Edit Mode too, where Blender keeps undo steps of its own."""
    clear()
    add_sketch(fan())
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.ed.undo_push(message="Mode")
    yield lambda: True
    for tool, count in (("stroke_mirror", 12), ("stroke_reverse", 12)):
        press(f"splash.{tool}")
        assert len(strokes()) == count
    press("ed.undo")
    press("ed.undo")
    assert len(strokes()) == 6 and bpy.context.active_object.mode == "EDIT"
    press("ed.redo")
    assert len(strokes()) == 12
    yield lambda: True


def overlay() -> Iterator[Condition]:
    """The overlay follows what is drawn, and warns of speeds beyond the training's."""
    clear()
    look()
    bpy.context.scene.splash.settings.speed_gain = 4.0
    add_sketch(fan(speed=0.5))
    bpy.context.window_manager.splash_show_speed = True

    def fastest() -> float:
        found = speed_map.current(bpy.context)
        return 0.0 if found is None else max(line.speeds.max() for line in found.lines)

    yield lambda: 0 < fastest() < 1
    before = fastest()
    assert press("splash.stroke_speed", multiplier=20.0) == {"FINISHED"}
    yield lambda: fastest() > 15 * before
    yield lambda: speed_overlay._batches is not None
    yield lambda: speed_overlay._batches.geometry.faulty.get(FAST) == 6
    assert press("splash.stroke_speed", multiplier=7.0, middle=2.0) == {"FINISHED"}
    yield from show("speed")
    press("ed.undo")
    press("ed.undo")
    yield lambda: fastest() < 2 * before
    bpy.context.window_manager.splash_show_speed = False


def clear() -> None:
    """Enter Object Mode and remove all objects."""
    if bpy.context.active_object is not None and bpy.context.active_object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)


def everything() -> Iterator[Condition]:
    """Check it all."""
    yield from first_crown()
    if PICTURES is None:
        yield from slow_and_fast()
        yield from by_tool_and_shortcut()
        yield from undo_in_edit_mode()
    yield from overlay()


if __name__ == "__main__":
    liquid_splash_addon.register()
    if PICTURES is None:
        loaded_generator.get = lambda *_: TubeGenerator()
        bpy.context.scene.splash.settings.resolution = "64"
    else:
        bpy.context.scene.splash.settings.speed_gain = GAIN
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.system.viewport_aa = "OFF"  # the processor draws: let it draw less
    bpy.app.timers.register(run(everything(), pause=TICK), first_interval=1.0, persistent=True)
