# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_bake_frames_window.py in a Blender with a window: bake, stop, go on, undo."""

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import loaded_generator, work_queue
from liquid_splash_addon.blender.scene import places
from tests.blender.running_scripts import Condition, run, show_tab
from tests.blender.sketching import evaluated_mesh
from tests.blender.window_script import GENERATOR, draw, idle, key, press, splashes

FIRST, LAST, SHOWN = 3, 14, 7


def baking() -> bool:
    return work_queue.collecting() is not None


def baked(folder: Path) -> Iterator[Condition]:
    """Check that the timeline stays, that Esc keeps what is done, that it goes on, and undo."""
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "window.blend"))
    scene = bpy.context.scene
    scene.frame_set(SHOWN)
    draw()
    assert press("splash.generate") == {"RUNNING_MODAL"}
    yield idle
    splash = splashes()[0]
    bpy.context.view_layer.objects.active = splash
    for frame, value in ((FIRST, 0.2), (LAST, 0.8)):
        splash.splash.settings.surface_threshold = value
        splash.keyframe_insert("splash.settings.surface_threshold", frame=frame)
    record = splash.splash_simulation
    record.bake.range, record.bake.first, record.bake.last = "OWN", FIRST, LAST
    bpy.ops.ed.undo_push(message="Keyed")
    yield show_tab
    vertices = len(splash.data.vertices)
    assert press("splash.bake_frames") == {"RUNNING_MODAL"}
    assert not bpy.ops.splash.bake_frames.poll() and not bpy.ops.splash.simulate.poll()
    yield lambda: record.motion is not None
    assert scene.frame_current == SHOWN and bpy.context.scene == scene, "it is still shown"
    key("ESC")
    yield lambda: not baking()
    done = record.frames
    assert 0 < done < record.wanted == LAST - FIRST + 1, "what is done was kept"
    assert press("splash.bake_frames") == {"RUNNING_MODAL"}
    yield lambda: not baking()
    assert record.frames == record.wanted and not record.warnings, record.warnings
    made = int(record.summary.split(", ")[1].split()[0])
    assert made <= record.wanted - done, record.summary
    assert len(splash.data.vertices) == vertices and scene.frame_current == SHOWN
    assert not [one for one in bpy.data.scenes if places.MARK in one], "nothing was left"
    shown = set()
    for frame in (FIRST, LAST):
        scene.frame_set(frame)
        shown.add(len(evaluated_mesh(record.motion)["position"]))
    assert len(shown) == 2
    press("ed.undo")
    assert splashes()[0].splash_simulation.frames == done, "one undo step"
    press("ed.redo")
    assert splashes()[0].splash_simulation.frames == LAST - FIRST + 1
    # Another file ends what runs.
    splashes()[0].splash_simulation.bake.last = 500
    bpy.context.view_layer.objects.active = splashes()[0]
    assert press("splash.bake_frames") == {"RUNNING_MODAL"}
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield lambda: not baking()


if __name__ == "__main__":
    liquid_splash_addon.register()
    loaded_generator.get = lambda *_: GENERATOR
    bpy.context.preferences.view.show_splash = False
    place = Path(tempfile.mkdtemp())
    bpy.app.timers.register(run(baked(place)), first_interval=1.0, persistent=True)
