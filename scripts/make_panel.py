# SPDX-License-Identifier: GPL-3.0-or-later
"""A picture of the Splash tab in a real window, with the crown and its strokes.

    blender --factory-startup --enable-event-simulate --window-geometry 0 0 1400 900 \
        --python scripts/make_panel.py -- panel.png

Needs X11 and ImageMagick. Presses the buttons that a new user presses: a preset sketch, then
*Generate Splash*.
"""

from __future__ import annotations

import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import bpy
from mathutils import Euler

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import work_queue

OUT = Path(sys.argv[-1]).resolve()

TURN = Euler((1.12, 0.0, 0.62))
"""From which side the splash is seen."""

TAB = 40
"""Pixels between clicks: less than a tab is high."""


def in_view(call: Callable[[], object]) -> None:
    """Do something in the 3D viewport."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        call()


def open_sidebar() -> None:
    """Open the sidebar, and turn the view."""
    space = bpy.context.area.spaces.active
    space.show_region_ui = True
    space.region_3d.view_rotation = TURN.to_quaternion()


def click_tab() -> Iterator[None]:
    """Click down the sidebar's tabs until ours is open."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    sidebar = next(region for region in area.regions if region.type == "UI")
    for down in range(TAB // 2, sidebar.height, TAB):
        if sidebar.active_panel_category == "Splash":
            return
        x, y = sidebar.x + sidebar.width - 12, sidebar.y + sidebar.height - down
        window.event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
        for value in ("PRESS", "RELEASE"):
            window.event_simulate("LEFTMOUSE", value, x=x, y=y)
        yield
    raise RuntimeError("the sidebar has no Splash tab")


def steps() -> Iterator[None]:
    """What is done, one step a tick, so that Blender draws in between."""
    liquid_splash_addon.register()
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    yield
    in_view(lambda: bpy.ops.splash.preset_sketch(preset="CROWN"))
    in_view(lambda: bpy.ops.object.mode_set(mode="OBJECT"))
    yield
    for _ in range(2):  # the second time as it is with everything loaded
        in_view(lambda: bpy.ops.splash.generate("INVOKE_DEFAULT", resolution="128"))
        while work_queue.collecting() is not None:
            yield
    in_view(open_sidebar)
    yield
    yield from click_tab()
    in_view(bpy.ops.view3d.view_selected)
    for _ in range(4):
        yield
    # Not Blender's own screenshot, which is black where a processor draws (Mesa).
    subprocess.run(["import", "-window", "root", str(OUT)], check=True)


def tick() -> float | None:
    """Do the next step; Blender's timer calls this."""
    try:
        next(work)
        return 0.5
    except StopIteration:
        print(f"panel: {OUT}")
    except Exception:
        traceback.print_exc()
    bpy.ops.wm.quit_blender()
    return None


work = steps()
bpy.app.timers.register(tick, first_interval=1.0)
