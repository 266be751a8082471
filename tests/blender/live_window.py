# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_live.py in a Blender with a window: the splash follows what is drawn and changed."""

import gc
import os
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np

import liquid_splash_addon
from liquid_splash_addon.blender.data.properties import to_settings
from liquid_splash_addon.blender.jobs import (
    draft_then_full,
    generate,
    live,
    loaded_generator,
    work_queue,
)
from liquid_splash_addon.blender.scene.targets import find_target
from tests.blender.running_scripts import Condition, run
from tests.blender.sketching import TubeGenerator, add_sketch, fan, splashes
from tests.blender.window_script import key

BURST = 50
UPDATES = 200
GROWTH = 0.02
"""Of the memory, over the updates after the first half of them."""

RESTED = 20
"""Looks of the script, a tenth of a second each, after which nothing will begin any more."""


def at_rest() -> bool:
    """Whether the full resolution is there and nothing waits."""
    return (
        not live.is_making()
        and work_queue.running() is None
        and not bpy.app.timers.is_registered(live.look)
    )


def pause(looks: int = RESTED) -> Condition:
    """Wait for some looks of the script, for what is not to happen."""
    left = iter(range(looks))
    return lambda: next(left, None) is None


def made(stage: str) -> Condition:
    """Wait for a stage of the splash to be over."""
    return lambda: (m := draft_then_full.making()) is not None and m.stage != stage and at_rest()


def empty() -> None:
    """Leave nothing in the scene, and be live."""
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    settings = bpy.context.scene.splash.settings
    settings.resolution, settings.real_size = "128", 0.32
    bpy.context.scene.splash.live = True


def computed_directly() -> np.ndarray:
    """Return the vertices of what the sketch gives without anything live."""
    target = find_target(bpy.context)
    settings = to_settings(target.splash.splash.settings)
    request = generate.snapshot(bpy.context, target, settings)
    return generate.compute(request, lambda *_: None).mesh.vertices


def vertices(splash: bpy.types.Object) -> np.ndarray:
    """Return a splash's vertices."""
    found = np.empty(len(splash.data.vertices) * 3, dtype=np.float32)
    splash.data.vertices.foreach_get("co", found)
    return found.reshape(-1, 3)


def check() -> None:
    """The one splash is at full resolution and what its sketch gives."""
    (splash,) = splashes()
    assert splash.splash.settings.resolution == "128", splash.splash.settings.resolution
    direct = computed_directly()
    ours = vertices(splash)
    assert ours.shape == direct.shape, (ours.shape, direct.shape, live.said())
    assert np.abs(ours - direct).max() < 1e-5


def nudge(sketch: bpy.types.Object, by: float) -> None:
    """Move the strokes a little against each other, as an edit does."""
    drawing = sketch.data.layers[0].current_frame().drawing
    values = np.empty(len(drawing.attributes["position"].data) * 3, dtype=np.float32)
    drawing.attributes["position"].data.foreach_get("vector", values)
    values[::3] *= 1 + by
    drawing.attributes["position"].data.foreach_set("vector", values)
    sketch.data.update_tag()
    bpy.context.view_layer.update()


def memory() -> int:
    """Return the bytes that this process has in memory."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def following() -> Iterator[Condition]:
    """Check strokes, settings, undo, Esc, and a burst of edits."""
    empty()
    sketch = add_sketch(fan())
    bpy.ops.ed.undo_push(message="Sketch")
    yield lambda: bool(splashes())
    drafted = len(splashes()[0].data.vertices)
    yield at_rest
    check()
    assert len(splashes()[0].data.vertices) > 2 * drafted, "a draft came first"
    assert bpy.context.active_object == splashes()[0]

    splashes()[0].splash.settings.variation = 0.0  # nothing more: a changed setting is followed
    splashes()[0].splash.settings.reach = 1.3
    yield made("draft")
    check()

    for number in range(BURST):
        nudge(sketch, 0.002 * (-1) ** number + 0.0005)
        yield lambda: True
    yield at_rest
    check()

    bpy.context.view_layer.objects.active = sketch
    nudge(sketch, 0.02)
    bpy.ops.ed.undo_push(message="Nudge")
    yield at_rest
    check()
    nudged = vertices(splashes()[0])
    bpy.ops.ed.undo()
    yield at_rest
    check()
    assert len(vertices(splashes()[0])) != len(nudged) or np.any(
        vertices(splashes()[0]) != nudged
    ), "undo is followed"

    sketch = find_target(bpy.context).sketch
    nudge(sketch, 0.01)
    yield live.is_making
    key("ESC")
    yield lambda: not live.is_making()
    yield at_rest  # a draft that stays gets its refinements
    stopped = vertices(splashes()[0])
    yield pause()
    assert np.array_equal(vertices(splashes()[0]), stopped) and not live.is_making(), "Esc stops"
    bpy.context.scene.splash.live = False
    nudge(sketch, 0.01)
    yield pause()
    assert not live.is_making(), "what is not live does not follow"


def soak() -> Iterator[Condition]:
    """Check that updates leave nothing behind in memory."""
    empty()
    sketch = add_sketch(fan())
    yield at_rest
    sizes = []
    for number in range(UPDATES):
        nudge(sketch, 0.004 * (-1) ** number)
        yield lambda: bpy.app.timers.is_registered(live.look) or live.is_making()
        yield at_rest if number % 10 == 0 else lambda: not work_queue.running()
        sizes.append(memory())
    half = sizes[UPDATES // 2 :]
    first, last = np.mean(half[:10]), np.mean(half[-10:])
    print(f"memory {first / 2**20:.0f} -> {last / 2**20:.0f} MB", flush=True)
    assert last < first * (1 + GROWTH), sizes
    assert len(bpy.data.meshes) <= 2 + len(splashes())


if __name__ == "__main__":
    liquid_splash_addon.register()
    bpy.context.preferences.view.show_splash = False
    loaded_generator.get = lambda *_: TubeGenerator()
    script = soak() if "soak" in sys.argv else following()
    bpy.app.timers.register(run(script, "live"), first_interval=1.0, persistent=True)
