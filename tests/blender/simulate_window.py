# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_simulate_window.py in a Blender with a window: simulate, click, stop, resume.

With a folder as argument it saves a picture of the window at each stage.
"""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import loaded_generator, work_queue
from liquid_splash_addon.blender.ui import panels
from liquid_splash_addon.blender.ui.refinement_panel import SPLASH_PT_refinements
from liquid_splash_addon.blender.ui.simulate_panel import (
    SPLASH_PT_simulation,
    SPLASH_PT_simulation_more,
)
from tests.blender.running_scripts import Condition, run
from tests.blender.window_script import GENERATOR, draw, idle, key, press, splashes

PICTURES = sys.argv[-1] if sys.argv[-1] != "--" else ""


def area() -> bpy.types.Area:
    return next(
        a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D"
    )


def show_tab() -> bool:
    """Open the sidebar at the tab; return whether it is shown."""
    area().spaces.active.show_region_ui = True
    try:
        next(r for r in area().regions if r.type == "UI").active_panel_category = "Splash"
    except (AttributeError, TypeError):  # it was not drawn yet
        return False
    return True


def picture(name: str) -> Iterator[Condition]:
    """Save what the window shows, if that is wanted."""
    if PICTURES:
        for _ in range(4):  # until it is drawn
            yield lambda: True
        # Not Blender's own screenshot, which is black where a processor draws (Mesa).
        subprocess.run(["import", "-window", "root", f"{PICTURES}/{name}.png"], check=True)


def still_running() -> bool:
    return work_queue.collecting(beside=True) is not None


def simulating(folder: Path) -> Iterator[Condition]:
    """Check that Blender stays usable, that Esc keeps what is done, and Resume and undo."""
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "window.blend"))
    draw()
    assert press("splash.generate") == {"RUNNING_MODAL"}
    yield idle
    splash = splashes()[0]
    bpy.context.view_layer.objects.active = splash
    record = splash.splash_simulation
    record.settings.frames, record.settings.resolution = 40, "96"
    yield show_tab
    yield from picture("before")
    assert press("splash.simulate") == {"RUNNING_MODAL"}
    assert still_running()
    # Meanwhile: other work, and another simulation is refused.
    assert not bpy.ops.splash.simulate.poll()
    assert press("splash.regenerate") == {"RUNNING_MODAL"}
    yield idle
    assert still_running(), "nothing waited for it"
    yield lambda: record.motion is not None
    yield from picture("running")
    bpy.context.scene.frame_set(2)
    key("ESC")
    yield lambda: not still_running()
    assert 0 < record.frames < record.wanted == 41, "what is done was kept"
    done = record.frames
    assert SPLASH_PT_simulation.poll(bpy.context)
    bpy.context.scene.frame_set(done)
    yield from picture("stopped")
    record.settings.frames = done + 1
    assert press("splash.simulate") == {"RUNNING_MODAL"}
    yield lambda: not still_running()
    assert record.frames == done + 2 == record.wanted and not record.warnings, record.warnings
    bpy.context.scene.frame_set(done + 2)
    yield from picture("done")
    press("ed.undo")
    record = splashes()[0].splash_simulation
    assert record.frames == done, "one undo step"
    press("ed.redo")
    assert splashes()[0].splash_simulation.frames == done + 2
    splashes()[0].splash_stack.flow_on.milliseconds = 4.0
    assert press("splash.flow_on") == {"RUNNING_MODAL"}
    yield idle
    assert splashes()[0].splash_stack.flowed
    # Another file ends what runs, and nothing is left of it.
    record = splashes()[0].splash_simulation
    record.settings.frames = 200
    assert press("splash.simulate") == {"RUNNING_MODAL"}
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield lambda: not still_running()


if __name__ == "__main__":
    if PICTURES:  # of this panel alone
        for panel in (panels.SPLASH_PT_settings, panels.SPLASH_PT_info, SPLASH_PT_refinements):
            panel.bl_options = {"DEFAULT_CLOSED"}
        SPLASH_PT_simulation.bl_options = SPLASH_PT_simulation_more.bl_options = set()
    liquid_splash_addon.register()
    loaded_generator.get = lambda *_: GENERATOR
    bpy.context.preferences.view.show_splash = False
    place = Path(tempfile.mkdtemp())
    bpy.app.timers.register(run(simulating(place)), first_interval=1.0, persistent=True)
