# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools on strokes: operators with a redo panel, made from core's tools; menu and panel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import bpy
from bpy.props import EnumProperty

from ...core.sketch.flow import Flow
from ...core.sketch.tools import TOOLS, StrokeTool
from ..data.properties import settings_properties, to_settings
from ..jobs.messages import sentence_for
from ..jobs.work_queue import print_unexpected
from ..scene.chosen_strokes import chosen_strokes
from ..scene.stroke_edit import write_derived, write_flow
from ..scene.stroke_sheets import TYPES
from ..scene.view_axes import PIVOTS, SPACES, place_for
from .panels import SplashPanel

MODES = ("OBJECT", "EDIT", "PAINT_GREASE_PENCIL", "SCULPT_GREASE_PENCIL", "SCULPT_CURVES")
"""Modes in which tools work; in others Blender keeps copies of its own."""

ICONS = {
    "SPIN": "FORCE_MAGNETIC",
    "MIRROR": "MOD_MIRROR",
    "LIFT": "MOD_SIMPLEDEFORM",
    "FILL": "MOD_ARRAY",
    "RESAMPLE": "MOD_SMOOTH",
    "REVERSE": "ARROW_LEFTRIGHT",
}

MENUS = (
    "VIEW3D_MT_object",
    "VIEW3D_MT_edit_greasepencil_stroke",
    "VIEW3D_MT_paint_grease_pencil",
    "VIEW3D_MT_edit_curves",
)
"""Blender's menus that get an entry, where they exist."""


class StrokeOperator:
    """What operators on strokes share: where they work, and what they say."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether the active object is a sketch, in a mode in which strokes can be changed."""
        active = context.active_object
        if active is None or active.type not in TYPES:
            cls.poll_message_set("Select a Grease Pencil sketch, or curves of the newer type")
            return False
        if active.mode not in MODES:
            cls.poll_message_set("Switch to Object, Edit or Draw Mode")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Change the strokes that are meant."""
        try:
            said, warnings = self.apply(context)
        except Exception as error:
            print_unexpected(error)
            self.report({"ERROR"}, sentence_for(error))
            return {"CANCELLED"}
        for warning in warnings:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, said)
        return {"FINISHED"}

    def apply(self, context: bpy.types.Context) -> tuple[str, list[str]]:
        """Change the strokes; return what was done, and warnings. Raises ValueError with advice."""
        raise NotImplementedError


class StrokeToolOperator(StrokeOperator):
    """What the operators of all tools share. They keep times, thickness, materials and layers."""

    tool: type[StrokeTool]

    def apply(self, context: bpy.types.Context) -> tuple[str, list[str]]:
        """Put what the tool makes of the strokes in their place, or beside them."""
        sketch = context.active_object
        chosen, warnings = chosen_strokes(sketch)
        if len(chosen) < self.tool.fewest:
            raise ValueError(
                f"{self.tool.label} needs {self.tool.fewest} strokes, here is {len(chosen)}: "
                "draw or select another one"
            )
        drawings = [stroke.drawing for stroke in chosen]
        tool = to_settings(self, self.tool)
        place = place_for(
            context,
            sketch,
            drawings,
            getattr(self, "space", "GLOBAL"),
            getattr(self, "pivot", "CURSOR"),
        )
        made = tool.apply(drawings, place)
        if not made:
            raise ValueError(
                "All these strokes lie in the mirror: move the pivot, or choose another axis"
            )
        write_derived(sketch, chosen, made, tool.keeps_strokes)
        verb = "added" if tool.keeps_strokes else f"from {len(chosen)}"
        return f"{self.tool.label}: {len(made)} stroke(s) {verb}", warnings

    def draw(self, _context: bpy.types.Context) -> None:
        """Show the settings, then the axes that they are in."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        for item in fields(self.tool):
            if self.shows(item.name):
                layout.prop(self, item.name)
        for name in ("space", "pivot"):
            if name in self.__annotations__:
                layout.prop(self, name)

    def shows(self, name: str) -> bool:
        """Whether a setting says anything as the others are."""
        by = getattr(self, "by", "")
        return not ((name == "count" and by == "SPACING") or (name == "spacing" and by == "COUNT"))


def operator_for(identifier: str, tool: type[StrokeTool]) -> type[bpy.types.Operator]:
    """Make the operator of a tool."""
    properties = settings_properties(tool)
    if any(item.name in ("axis", "direction") for item in fields(tool)):
        properties["space"] = EnumProperty(
            items=SPACES, name="Axes", description="Whose axes are meant"
        )
    if any(item.name == "axis" for item in fields(tool)):
        properties["pivot"] = EnumProperty(
            items=PIVOTS, name="Pivot", description="Point that the axis or the mirror goes through"
        )
    body = {
        "__doc__": tool.about,
        "__annotations__": properties,
        "__module__": __name__,
        "bl_idname": f"splash.stroke_{identifier.lower()}",
        "bl_label": tool.label,
        "tool": tool,
    }
    name = f"SPLASH_OT_stroke_{identifier.lower()}"
    return type(name, (StrokeToolOperator, bpy.types.Operator), body)


OPERATORS = {identifier: operator_for(identifier, tool) for identifier, tool in TOOLS.items()}


def draw_tools(layout: Any) -> None:
    """Draw an entry for each tool."""
    for identifier, operator in OPERATORS.items():
        layout.operator(operator.bl_idname, icon=ICONS[identifier])


class SPLASH_OT_stroke_speed(StrokeOperator, bpy.types.Operator):
    """Change how fast the liquid flows along strokes, and which way, without drawing them anew"""

    bl_idname = "splash.stroke_speed"
    bl_label = "Stroke Speed"
    # Not remembered: the redo panel begins with what the strokes have.
    __annotations__ = settings_properties(Flow, options={"SKIP_SAVE"})

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Begin with what the first of the strokes has, where nothing else is asked for."""
        try:
            chosen, _ = chosen_strokes(context.active_object)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for name, value in vars(chosen[0].flow).items():
            if not self.properties.is_property_set(name):
                setattr(self, name, value)
        return self.execute(context)

    def apply(self, context: bpy.types.Context) -> tuple[str, list[str]]:
        """Have the strokes remember it."""
        chosen, warnings = chosen_strokes(context.active_object)
        write_flow(context.active_object, chosen, to_settings(self, Flow))
        return f"Speed of {len(chosen)} stroke(s) set", warnings

    def draw(self, _context: bpy.types.Context) -> None:
        """Show factor and direction, then the profile."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "multiplier")
        layout.prop(self, "backward")
        column = layout.column(align=True)
        for name in ("start", "middle", "end"):
            column.prop(self, name)


class SPLASH_MT_strokes(bpy.types.Menu):
    """Tools on the strokes of a splash's sketch"""

    bl_idname = "SPLASH_MT_strokes"
    bl_label = "Splash Strokes"

    def draw(self, _context: bpy.types.Context) -> None:
        """Show the tools."""
        draw_tools(self.layout)
        self.layout.separator()
        self.layout.operator(SPLASH_OT_stroke_speed.bl_idname, icon="FORCE_WIND")


class SPLASH_PT_strokes(SplashPanel, bpy.types.Panel):
    """Tools on the strokes of the active sketch."""

    bl_label = "Strokes"
    bl_parent_id = "SPLASH_PT_main"
    bl_order = 1

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether the active object is a sketch."""
        active = context.active_object
        return active is not None and active.type in TYPES

    def draw(self, context: bpy.types.Context) -> None:
        """Show the tools, and the switch of the overlay."""
        grid = self.layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        draw_tools(grid)
        row = self.layout.row(align=True)
        row.operator(SPLASH_OT_stroke_speed.bl_idname, icon="FORCE_WIND")
        row.prop(context.window_manager, "splash_show_speed", text="", icon="OVERLAY")


def draw_in_menu(self: Any, context: bpy.types.Context) -> None:
    """Add the tools to a menu of Blender's, where strokes are what is worked on."""
    active = context.active_object
    if active is not None and active.type in TYPES:
        self.layout.separator()
        self.layout.menu(SPLASH_MT_strokes.bl_idname)


def blender_menus() -> list[Any]:
    """Return those of Blender's MENUS that there are."""
    found = (getattr(bpy.types, name, None) for name in MENUS)
    return [menu for menu in found if menu is not None]


register_classes: Callable[[], None]
register_classes, unregister_classes = bpy.utils.register_classes_factory(
    (*OPERATORS.values(), SPLASH_OT_stroke_speed, SPLASH_MT_strokes, SPLASH_PT_strokes)
)


def register() -> None:
    """Add the operators, the panel and the entries in Blender's menus."""
    register_classes()
    for menu in blender_menus():
        menu.append(draw_in_menu)


def unregister() -> None:
    """Remove all of them."""
    for menu in blender_menus():
        menu.remove(draw_in_menu)
    unregister_classes()
