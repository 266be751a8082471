# SPDX-License-Identifier: GPL-3.0-or-later
"""Run a script in a Blender with a window: steps, with a condition to wait for after each."""

from __future__ import annotations

import os
import sys
import time
import traceback
from collections.abc import Callable, Iterator

Condition = Callable[[], bool]

PATIENCE = 600.0
"""Seconds until a condition that does not come true is a failure."""


def run(
    script: Iterator[Condition],
    name: str = "window",
    patience: float = PATIENCE,
    pause: float = 0.1,
    explain: Callable[[], object] = lambda: None,
) -> Callable[[], float | None]:
    """Return a timer callback that takes ``script`` through its steps, then ends Blender.

    name : of what is tested; patience, pause : seconds that a condition may take, and between two
    looks at it; explain : called where the script fails.
    """
    condition: Condition = lambda: True  # noqa: E731
    since = time.monotonic()

    def resume() -> float | None:
        nonlocal condition, since
        try:
            if condition():
                condition, since = next(script), time.monotonic()
            assert time.monotonic() - since < patience, "nothing happens"
        except StopIteration:
            print(f"{name}: works", flush=True)
            os._exit(0)
        except BaseException:
            traceback.print_exc()
            explain()
            sys.stderr.flush()
            os._exit(1)
        return pause

    return resume


def show_tab() -> bool:
    """Open the sidebar of the 3D viewport at the add-on's tab; return whether it is shown."""
    import bpy

    screen = bpy.context.window_manager.windows[0].screen
    area = next(area for area in screen.areas if area.type == "VIEW_3D")
    area.spaces.active.show_region_ui = True
    region = next(region for region in area.regions if region.type == "UI")
    try:
        region.active_panel_category = "Splash"
    except (AttributeError, TypeError):  # it was not drawn yet
        return False
    return True
