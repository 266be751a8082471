# SPDX-License-Identifier: GPL-3.0-or-later
"""The model in the Splash tab: its splashes, how they are joined, symmetry, waves, obstacles."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import bpy

from ...core.refinement.settings import RefinementSettings, SheetSettings, WaveSettings
from ..data.model import is_model
from ..jobs import scheduler
from . import model_operators as operators
from .panels import SplashPanel, draw_eye, draw_warnings, settings_column
from .refinement_panel import draw_verdicts


class SPLASH_UL_parts(bpy.types.UIList):
    """One row for each splash: its name, and an eye to leave it out."""

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
        if item.is_there:
            row.prop(item.splash, "name", text="", emboss=False, icon="MOD_FLUIDSIM")
        else:
            row.label(text=f"{item.name} (deleted)", icon="ERROR")
        draw_eye(row, item)


class ModelPanel(SplashPanel):
    """What the panels of a model share."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether a model is active."""
        return is_model(context.active_object)


class SPLASH_PT_model(ModelPanel, bpy.types.Panel):
    """The splashes of the active model and how they are joined."""

    bl_label = "Model"
    bl_parent_id = "SPLASH_PT_main"
    bl_order = -1

    def draw(self, context: bpy.types.Context) -> None:
        """Show the list with its buttons, then the settings."""
        layout = self.layout
        model = context.active_object
        group = model.splash_model
        row = layout.row()
        row.template_list("SPLASH_UL_parts", "", group, "parts", group, "active", rows=3)
        buttons = row.column(align=True)
        buttons.menu(operators.SPLASH_MT_parts.bl_idname, text="", icon="ADD")
        buttons.operator(operators.SPLASH_OT_part_remove.bl_idname, text="", icon="REMOVE")
        column = settings_column(layout)
        settings = group.settings
        column.prop(settings, "blend")
        mirrors = column.row(heading="Mirror", align=True)
        for axis in "xyz":
            mirrors.prop(settings, f"mirror_{axis}", toggle=True)
        column.prop(settings, "count")
        if settings.count > 1:
            column.row().prop(settings, "axis", expand=True)
        column.prop(model.splash_obstacles, "collection", text="Obstacles")
        if model.splash_obstacles.collection is not None:
            column.prop(model.splash_obstacles, "clearance")
            draw_verdicts(layout, model.splash_obstacles)
        layout.operator(operators.SPLASH_OT_model_update.bl_idname, icon="FILE_REFRESH")
        # The first evaluation compiles code for seconds: show that something happens.
        if text := scheduler.stage_of(model) or group.summary:
            layout.label(text=text)
        draw_warnings(layout, context, group.warnings)


class SPLASH_PT_model_sheets(ModelPanel, bpy.types.Panel):
    """Sheets on the model's joined surface."""

    bl_label = "Sheets"
    bl_parent_id = "SPLASH_PT_model"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw_header(self, context: bpy.types.Context) -> None:
        """Show the switch."""
        self.layout.prop(context.active_object.splash_model, "use_sheets", text="")

    def draw(self, context: bpy.types.Context) -> None:
        """Show the sliders."""
        draw_sliders(self.layout, context.active_object.splash_model, "sheets", SheetSettings)


class SPLASH_PT_model_waves(ModelPanel, bpy.types.Panel):
    """Waves on the model's joined surface."""

    bl_label = "Waves"
    bl_parent_id = "SPLASH_PT_model"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw_header(self, context: bpy.types.Context) -> None:
        """Show the switch."""
        self.layout.prop(context.active_object.splash_model, "use_waves", text="")

    def draw(self, context: bpy.types.Context) -> None:
        """Show the sliders."""
        draw_sliders(self.layout, context.active_object.splash_model, "waves", WaveSettings)


def draw_sliders(layout: Any, group: Any, name: str, settings: type[RefinementSettings]) -> None:
    """Draw the settings of a refinement of the joined surface, grey where it is switched off."""
    column = layout.column()
    column.use_property_split = True
    column.active = getattr(group, f"use_{name}")
    for field in fields(settings):
        column.prop(getattr(group, name), field.name)


register, unregister = bpy.utils.register_classes_factory(
    (SPLASH_UL_parts, SPLASH_PT_model, SPLASH_PT_model_sheets, SPLASH_PT_model_waves)
)
