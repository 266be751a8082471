# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to begin a sketch: the menu beside New Sketch, a tool in the toolbar, a shortcut."""

from __future__ import annotations

from typing import Any

import bpy

from ..scene.sketch import PLACEMENTS, is_sketch, new_sketch, start_drawing
from ..scene.world_strokes import can_be_drawn_on
from . import operators

SHORTCUT = {"type": "W", "value": "PRESS", "shift": True, "alt": True}
"""W for water. Blender's own keys leave it free."""


class SPLASH_MT_new_sketch(bpy.types.Menu):
    """New Sketch, by where strokes lie"""

    bl_idname = "SPLASH_MT_new_sketch"
    bl_label = "Strokes Lie"

    def draw(self, _context: bpy.types.Context) -> None:
        """Show the ways to place strokes."""
        self.layout.operator_context = "EXEC_DEFAULT"
        for identifier, placement in PLACEMENTS.items():
            entry = self.layout.operator(
                operators.SPLASH_OT_new_sketch.bl_idname, text=placement.label
            )
            entry.placement = identifier


class SPLASH_OT_draw_stroke(bpy.types.Operator):
    """Draw a stroke of a splash: on the active sketch, or on a new one at the 3D cursor"""

    bl_idname = "splash.draw_stroke"
    bl_label = "Draw Splash Stroke"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a viewport to draw in."""
        return context.space_data is not None and context.space_data.type == "VIEW_3D"

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Enter Draw Mode, and hand the pressed button on to Blender's brush."""
        self.execute(context)
        if bpy.ops.grease_pencil.brush_stroke.poll():
            bpy.ops.grease_pencil.brush_stroke("INVOKE_DEFAULT")
        return {"FINISHED"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Enter Draw Mode on the sketch."""
        active = context.active_object
        is_usable = is_sketch(active) and can_be_drawn_on(active)
        start_drawing(context, active if is_usable else new_sketch(context))
        return {"FINISHED"}


class SketchTool(bpy.types.WorkSpaceTool):
    """The tool in the toolbar of Object Mode."""

    bl_space_type = "VIEW_3D"
    bl_context_mode = "OBJECT"
    bl_idname = "splash.sketch"
    bl_label = "Splash Sketch"
    bl_description = (
        "Draw strokes that become a splash. The first one makes a sketch at the 3D cursor; how "
        "fast you draw is how fast the liquid moves"
    )
    bl_icon = "ops.gpencil.draw"
    bl_keymap = ((SPLASH_OT_draw_stroke.bl_idname, {"type": "LEFTMOUSE", "value": "PRESS"}, None),)

    @staticmethod
    def draw_settings(_context: Any, layout: Any, _tool: Any) -> None:
        """Show in the tool's header what one does next."""
        layout.operator(operators.SPLASH_OT_new_sketch.bl_idname, icon="GREASEPENCIL")
        layout.operator(operators.SPLASH_OT_generate.bl_idname, icon="MOD_FLUIDSIM")


_shortcuts: list[tuple[Any, Any]] = []

register_classes, unregister_classes = bpy.utils.register_classes_factory(
    (SPLASH_MT_new_sketch, SPLASH_OT_draw_stroke)
)


def register() -> None:
    """Add menu, tool and shortcut. Without a window there are neither tools nor keys."""
    register_classes()
    if bpy.app.background:
        return
    bpy.utils.register_tool(SketchTool, separator=True)
    configuration = bpy.context.window_manager.keyconfigs.addon
    if configuration is not None:
        keymap = configuration.keymaps.new(name="3D View", space_type="VIEW_3D")
        item = keymap.keymap_items.new(operators.SPLASH_OT_new_sketch.bl_idname, **SHORTCUT)
        _shortcuts.append((keymap, item))


def unregister() -> None:
    """Remove them."""
    for keymap, item in _shortcuts:
        keymap.keymap_items.remove(item)
    _shortcuts.clear()
    if not bpy.app.background:
        bpy.utils.unregister_tool(SketchTool)
    unregister_classes()
