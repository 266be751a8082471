# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of refinements in the Splash tab; it looks and works like the list of modifiers."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import bpy

from ..jobs import flow_on, scheduler
from ..scene.targets import shown_splash
from . import refinement_operators as operators
from .panels import SplashPanel, draw_eye, draw_text, draw_warnings, settings_column
from .select_named import draw_button

ICONS = {
    "DROPLETS": "META_BALL",
    "RUPTURES": "MOD_EXPLODE",
    "SHEETS": "MOD_CLOTH",
    "WAVES": "MOD_WAVE",
    "CLEANUP": "BRUSH_DATA",
}


class SPLASH_UL_refinements(bpy.types.UIList):
    """One row for each refinement: its name, and an eye to switch it off."""

    def draw_item(
        self,
        _context: Any,
        layout: Any,
        _data: Any,
        item: Any,
        _icon: int,
        _active_data: Any,
        _active_property: str,
    ) -> None:
        """Draw the row."""
        row = layout.row(align=True)
        row.active = item.show
        row.prop(item, "name", text="", emboss=False, icon=ICONS[item.kind])
        draw_eye(row, item)


class SPLASH_PT_refinements(SplashPanel, bpy.types.Panel):
    """The refinements of the active splash."""

    bl_label = "Refinements"
    bl_parent_id = "SPLASH_PT_main"
    bl_order = 1
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash to refine."""
        return shown_splash(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Show the list with its buttons, and the settings of its active entry."""
        layout = self.layout
        splash = shown_splash(context)
        stack = splash.splash_stack
        draw_flow_on(layout, context, splash)
        row = layout.row()
        row.template_list("SPLASH_UL_refinements", "", stack, "items", stack, "active", rows=4)
        buttons = row.column(align=True)
        buttons.operator_menu_enum(
            operators.SPLASH_OT_refinement_add.bl_idname, "kind", text="", icon="ADD"
        )
        buttons.operator(operators.SPLASH_OT_refinement_remove.bl_idname, text="", icon="REMOVE")
        buttons.separator()
        move = operators.SPLASH_OT_refinement_move.bl_idname
        buttons.operator(move, text="", icon="TRIA_UP").direction = "UP"
        buttons.operator(move, text="", icon="TRIA_DOWN").direction = "DOWN"
        row = layout.row(align=True)
        row.operator_menu_enum(
            operators.SPLASH_OT_refinement_preset.bl_idname, "preset", text="Preset", icon="PRESET"
        )
        row.operator(operators.SPLASH_OT_refinement_apply.bl_idname, text="Apply", icon="CHECKMARK")
        draw_settings(layout, stack)
        layout.operator(operators.SPLASH_OT_drop_points.bl_idname, icon="POINTCLOUD_DATA")
        # The first use of a kind compiles code for seconds: show that something happens.
        if text := scheduler.stage_of(splash) or stack.summary:
            layout.label(text=text)
        draw_warnings(layout, context, stack.warnings)


class SPLASH_PT_obstacles(SplashPanel, bpy.types.Panel):
    """The obstacles of the active splash."""

    bl_label = "Obstacles"
    bl_parent_id = "SPLASH_PT_main"
    bl_order = 2
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash."""
        return shown_splash(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Show the collection, what its objects count as, and the button for moved obstacles."""
        layout = self.layout
        group = shown_splash(context).splash_obstacles
        column = settings_column(layout)
        column.prop(group, "collection", text="Collection")
        column.prop(group, "clearance")
        draw_verdicts(layout, group)
        layout.operator(operators.SPLASH_OT_refinement_update.bl_idname, icon="FILE_REFRESH")


def draw_verdicts(layout: Any, group: Any) -> None:
    """Show what each obstacle was taken for, with the choice and a button that selects it."""
    column = layout.column(align=True)
    for name, verdict in group.listed if group.collection is not None else ():
        row = column.row(align=True)
        item = bpy.data.objects.get(name)
        row.label(text=f"{name}: {verdict}")
        if item is not None:
            row.prop(item.splash_obstacle, "kind", text="")
            draw_button(row, name)


def draw_flow_on(layout: Any, context: bpy.types.Context, splash: bpy.types.Object) -> None:
    """Show the time that the splash flows on before all refinements, and its button."""
    row = layout.row(align=True)
    row.prop(splash.splash_stack.flow_on, "milliseconds", slider=True)
    is_new = not flow_on.is_up_to_date(splash)
    button = row.row(align=True)
    button.alert = is_new
    icon = "FILE_REFRESH" if is_new else "CHECKMARK"
    button.operator(operators.SPLASH_OT_flow_on.bl_idname, text="", icon=icon)
    if is_new:
        draw_text(layout, context, "Flow On is out of date: press its button", "INFO")


def draw_settings(layout: Any, stack: Any) -> None:
    """Show the settings of the active refinement."""
    if not 0 <= stack.active < len(stack.items):
        return
    item = stack.items[stack.active]
    column = settings_column(layout)
    column.active = item.show
    for field in fields(item.settings):
        column.prop(item.group, field.name)


register, unregister = bpy.utils.register_classes_factory(
    (SPLASH_UL_refinements, SPLASH_PT_refinements, SPLASH_PT_obstacles)
)
