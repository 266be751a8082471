# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_environment.py in a Blender with a window: what goes away in the middle of a run."""

import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import loaded_generator, work_queue
from liquid_splash_addon.blender.ui import queued_operator
from tests.blender.running_scripts import Condition, run
from tests.blender.sketching import splashes
from tests.blender.window_script import GENERATOR, draw, idle, press


def running() -> bool:
    """Whether a splash is being computed."""
    return work_queue.running() is not None


def pause(looks: int = 5) -> Condition:
    """Wait for some looks of the script, for what is not to happen."""
    left = iter(range(looks))
    return lambda: next(left, None) is None


def press_in(window: bpy.types.Window, name: str) -> set[str]:
    """Run one of our operators as its button does, in the 3D viewport of a window."""
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        return getattr(bpy.ops.splash, name)("INVOKE_DEFAULT")


def disabled() -> Iterator[Condition]:
    """Disable the add-on while a splash is made: nothing is written, and enabled it works again."""
    draw()
    GENERATOR.seconds = 1.0
    assert press("splash.generate") == {"RUNNING_MODAL"}
    yield running
    liquid_splash_addon.unregister()
    assert not queued_operator._timers, "its timer is gone, and the line in the status bar"
    yield pause(15)
    assert not hasattr(bpy.types.Object, "splash")
    assert not [item for item in bpy.data.objects if item.type == "MESH"]
    liquid_splash_addon.register()
    assert idle()
    bpy.context.view_layer.objects.active = bpy.data.objects[0]
    group = bpy.context.scene.splash
    group.settings.resolution, group.settings.real_size, group.start = "64", 0.32, "BARE"
    assert press("splash.generate") == {"RUNNING_MODAL"}
    yield idle
    assert len(splashes()) == 1


def other_file() -> Iterator[Condition]:
    """Open a file while a splash is made, and while one is refined."""
    path = str(Path(bpy.app.tempdir) / "other.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    count = len(splashes())
    draw()
    press("splash.generate")
    yield running
    bpy.ops.wm.open_mainfile(filepath=path)
    yield pause(15)
    assert idle() and not queued_operator._timers and len(splashes()) == count
    bpy.context.view_layer.objects.active = splashes()[0]
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.splash.refinement_add("EXEC_DEFAULT", True, kind="DROPLETS")
    bpy.ops.wm.open_mainfile(filepath=path)
    yield pause(15)
    assert not splashes()[0].splash_stack.items


def two_windows() -> Iterator[Condition]:
    """Make a splash from a second window, and close that window while one is made."""
    draw()
    manager = bpy.context.window_manager
    with bpy.context.temp_override(window=manager.windows[0]):
        bpy.ops.wm.window_new_main()
    yield pause()
    second = manager.windows[1]
    assert press_in(second, "generate") == {"RUNNING_MODAL"}
    yield idle
    assert len(splashes()) == 1
    assert press_in(second, "regenerate") == {"RUNNING_MODAL"}
    yield running
    assert not bpy.ops.splash.regenerate.poll(), "one at a time, in all windows"
    with bpy.context.temp_override(window=second):
        bpy.ops.wm.window_close()
    yield idle
    yield lambda: not running()
    assert len(manager.windows) == 1
    assert press("splash.regenerate") == {"RUNNING_MODAL"}, "nothing waits for that window"
    yield idle
    assert len(splashes()) == 1


def everything() -> Iterator[Condition]:
    """Check it all."""
    yield from disabled()
    yield from other_file()
    yield from two_windows()


if __name__ == "__main__":
    liquid_splash_addon.register()
    loaded_generator.get = lambda *_: GENERATOR
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(run(everything()), first_interval=1.0, persistent=True)
