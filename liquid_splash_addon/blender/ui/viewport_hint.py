# SPDX-License-Identifier: GPL-3.0-or-later
"""One line in the viewport that says what to do next, until there is a splash."""

from __future__ import annotations

from typing import Any

import bpy

from ..data import index
from ..data.preferences import own_preferences
from ..jobs import work_queue
from ..scene.grease_pencil import has_strokes
from ..scene.sketch import is_sketch
from .viewport_text import lower_edge, width_of, write

ENOUGH = 5
"""Strokes that make a splash by themselves; fewer are better spun or filled first."""

SIZE, ABOVE = 13, 28
"""Height of the letters, and of the line above the lower edge, in pixels at scale 1."""

TAB = "the Splash tab (N)"

BEGIN = f"New Sketch in {TAB}, or Shift Alt W: draw the way the liquid flows"
DRAW = "Draw a stroke the way the liquid flows. Draw faster, and it flows faster"
RESUME = "Switch to Draw Mode and draw a stroke the way the liquid flows"
FEW = f"Spin in {TAB} makes a crown of it. Or draw {ENOUGH} to 20 strokes and generate"
MAKE = f"Generate Splash in {TAB}"


def hint_for(context: bpy.types.Context) -> str:
    """Return what to do next; "" where one knows, or does something else."""
    preferences = own_preferences(context)
    if preferences is not None and not preferences.show_hints:
        return ""
    if index.splashes(context.scene) or work_queue.collecting() is not None:
        return ""
    active = context.active_object
    if not is_sketch(active):
        return BEGIN if is_tab_open(context) else ""
    count = stroke_count(active)
    if count == 0:
        return DRAW if active.mode == "PAINT_GREASE_PENCIL" else RESUME
    return FEW if count < ENOUGH else MAKE


def stroke_count(sketch: bpy.types.Object) -> int:
    """Return how many strokes a sketch has at the current frame."""
    return sum(
        len(layer.current_frame().drawing.curve_offsets) - 1
        for layer in sketch.data.layers
        if has_strokes(layer)
    )


def is_tab_open(context: bpy.types.Context) -> bool:
    """Whether the sidebar of this viewport shows the Splash tab."""
    if context.area is None or not context.space_data.show_region_ui:
        return False
    sidebar = next((r for r in context.area.regions if r.type == "UI"), None)
    return sidebar is not None and sidebar.active_panel_category == "Splash"


def draw() -> None:
    """Draw the hint at the lower edge of the viewport; Blender calls this for each one."""
    context = bpy.context
    if not context.space_data.overlay.show_overlays:
        return
    text = hint_for(context)
    if text:
        scale = context.preferences.system.ui_scale
        left = (context.region.width - width_of(text, SIZE * scale)) / 2
        write(text, (left, lower_edge(context) + ABOVE * scale), SIZE * scale)


_handler: Any = None


def register() -> None:
    """Draw in 3D viewports from now on."""
    global _handler
    if not bpy.app.background:
        _handler = bpy.types.SpaceView3D.draw_handler_add(draw, (), "WINDOW", "POST_PIXEL")


def unregister() -> None:
    """Draw no more."""
    global _handler
    if _handler is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handler, "WINDOW")
        _handler = None
