# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_files_window.py in a Blender with a window: files chosen in the browser, and dropped.

Words after ``--``: the folder to work in, with a file ``painting.apa``.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import work_queue
from tests.blender.running_scripts import Condition, run

FOLDER = Path(sys.argv[-1])


def start(name: str, **options) -> set[str]:
    """Run an operator as a menu or a drop does, in the 3D viewport."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        return getattr(bpy.ops.splash, name)("INVOKE_DEFAULT", **options)


def browser():
    """Return window, area and space of the file browser; None while there is none."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "FILE_BROWSER" and area.spaces.active.params is not None:
                return window, area, area.spaces.active
    return None


def choose(name: str) -> None:
    """Choose a file in the browser; the key confirms, as its window may not close in a script."""
    window, area, space = browser()
    space.params.directory = str(FOLDER).encode()
    space.params.filename = name
    x, y = area.x + area.width // 2, area.y + area.height // 2
    window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
    for value in ("PRESS", "RELEASE"):
        window.event_simulate("RET", value, x=x, y=y)


def undo() -> None:
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.ed.undo()


def idle() -> bool:
    return work_queue.collecting() is None and not work_queue.is_waiting()


def sketches() -> list[str]:
    return sorted(o.name for o in bpy.context.scene.objects if o.type == "GREASEPENCIL")


def steps() -> Iterator[Condition]:
    """Import by browser and by drop, undo both, export; each yield waits for its condition."""
    bpy.ops.ed.undo_push(message="Begin")
    assert start("choose_stroke_files") == {"RUNNING_MODAL"}
    yield lambda: browser() is not None
    choose("painting.apa")
    yield lambda: sketches() == ["painting"] and idle()
    assert browser() is None
    undo()
    yield lambda: sketches() == []

    assert start("import_strokes", filepath=str(FOLDER / "painting.apa")) == {"RUNNING_MODAL"}
    assert sketches() == [], "Blender stays usable meanwhile"
    yield lambda: sketches() == ["painting"] and idle()
    undo()
    assert sketches() == [], "one undo step"

    # As Blender's own handler for dropped files starts it.
    start(
        "import_strokes", directory=str(FOLDER), files=[{"name": "painting.apa"}, {"name": "x.csv"}]
    )
    yield lambda: sketches() == ["painting"] and idle()

    assert start("choose_export_file") == {"RUNNING_MODAL"}
    yield lambda: browser() is not None
    choose("written.csv")
    yield lambda: (FOLDER / "written.csv").exists() and idle()
    assert (FOLDER / "written.csv").read_text().count("\n") == 4 * 40 + 4


if __name__ == "__main__":
    liquid_splash_addon.register()
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(run(steps()), first_interval=1.0, persistent=True)
