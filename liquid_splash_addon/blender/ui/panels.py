# SPDX-License-Identifier: GPL-3.0-or-later
"""The Splash tab in the 3D viewport's sidebar."""

from __future__ import annotations

import textwrap
from dataclasses import fields
from typing import Any

import bpy

from ...core.settings import SplashSettings
from ..jobs import (
    compile_ahead,
    dependencies,
    draft_then_full,
    live,
    problems,
    staleness,
    work_queue,
)
from ..scene.targets import shown_splash
from . import (
    bake_operators,
    model_operators,
    operators,
    select_named,
    sketch_presets,
    sketch_tool,
    splash_operators,
)

SLIDERS = {"variation", "surface_threshold"}
PIXELS_PER_LETTER = 6.5
"""Mean width of a letter in the interface font at scale 1, for wrapping text."""


class SplashPanel:
    """What the panels of the tab share."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Splash"


class SPLASH_PT_main(SplashPanel, bpy.types.Panel):
    """The buttons."""

    bl_label = "Liquid Splash"

    def draw(self, context: bpy.types.Context) -> None:
        """Show the buttons, and the progress of a running splash."""
        layout = self.layout
        draw_missing(layout, context)
        draw_preparing(layout, context)
        draw_problems(layout, context)
        row = layout.row(align=True)
        row.operator(operators.SPLASH_OT_new_sketch.bl_idname, icon="GREASEPENCIL")
        row.menu(sketch_tool.SPLASH_MT_new_sketch.bl_idname, text="", icon="DOWNARROW_HLT")
        row.menu(sketch_presets.SPLASH_MT_preset_sketches.bl_idname)
        main = layout.column()
        main.scale_y = 1.5
        entry = work_queue.collecting()
        if entry is None:
            main.operator(operators.SPLASH_OT_generate.bl_idname, icon="MOD_FLUIDSIM")
        else:  # in the button's place, so that nothing moves
            main.progress(factor=entry.fraction, text=f"{entry.line} (Esc to stop)")
        splash = shown_splash(context)
        if splash is None:
            layout.prop(context.scene.splash, "start")
        draw_live(layout, context)
        row = layout.row(align=True)
        button = row.row(align=True)
        is_stale = splash is not None and staleness.is_out_of_date(splash)
        button.alert = is_stale
        text = "Out of Date: Regenerate" if is_stale else operators.SPLASH_OT_regenerate.bl_label
        button.operator(
            operators.SPLASH_OT_regenerate.bl_idname,
            text=text,
            icon="ERROR" if is_stale else "FILE_REFRESH",
        )
        row.operator(operators.SPLASH_OT_realign.bl_idname, icon="ORIENTATION_LOCAL")
        row = layout.row(align=True)
        row.operator(model_operators.SPLASH_OT_generate_layers.bl_idname, icon="RENDERLAYERS")
        row.operator(model_operators.SPLASH_OT_combine.bl_idname, icon="MOD_BOOLEAN")
        if splash is not None:
            draw_seed(layout, splash)
            draw_follow(layout, splash)
            draw_animated(layout, context, splash)
            draw_advice(layout, context, splash.splash.warnings)
            if splash.splash.regime:
                draw_text(layout, context, splash.splash.regime, "CON_SIZELIKE")


class SPLASH_PT_settings(SplashPanel, bpy.types.Panel):
    """The settings of the active splash, or those for new ones."""

    bl_label = "Settings"
    bl_parent_id = "SPLASH_PT_main"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: bpy.types.Context) -> None:
        """Show whose settings they are, then the settings."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        splash = shown_splash(context)
        if splash is None:
            layout.label(text="For new splashes", icon="SCENE_DATA")
            layout.prop(context.scene.splash, "follow")
        else:
            layout.label(text=splash.name, icon="MOD_FLUIDSIM")
        group = (context.scene if splash is None else splash).splash.settings
        column = layout.column()
        for item in fields(SplashSettings):
            column.prop(group, item.name, slider=item.name in SLIDERS)


class SPLASH_PT_info(SplashPanel, bpy.types.Panel):
    """The result of the last run, and what it was made of."""

    bl_label = "Last Run"
    bl_parent_id = "SPLASH_PT_main"
    bl_order = 9
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash."""
        return shown_splash(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Show the result, then what the splash is made of; its warnings are at the top."""
        layout = self.layout
        record = shown_splash(context).splash
        layout.label(text=record.summary)
        layout.label(text=f"{record.device}, {record.precision}, network {record.weights_hash[:8]}")
        layout.use_property_split = True
        layout.prop(record, "sketch")
        for other in record.others:
            layout.prop(other, "sketch")
        if record.sketch is not None and record.sketch.type == "GREASEPENCIL":
            layout.prop_search(record, "layer", record.sketch.data, "layers")


def draw_live(layout: Any, context: bpy.types.Context) -> None:
    """Show whether the splash follows the hand, and how far it is or what it said."""
    group, making = context.scene.splash, draft_then_full.making()
    layout.prop(group, "live", toggle=True, icon="REC")
    if not group.live:
        return
    if making is not None and making.is_busy:
        stage, share = making.progress
        layout.progress(factor=share, text=f"{stage} (Esc to stop)")
    elif live.said():
        draw_text(layout, context, live.said())


def draw_missing(layout: Any, context: bpy.types.Context) -> None:
    """Show what to install if the generator cannot run."""
    complaint = dependencies.complaint()
    if not complaint:
        return
    box = layout.box()
    draw_text(box, context, complaint, "ERROR")
    draw_text(box, context, dependencies.install_command())
    box.operator(operators.SPLASH_OT_copy_install_command.bl_idname, icon="COPYDOWN")


def draw_problems(layout: Any, context: bpy.types.Context) -> None:
    """Show what went wrong and still does, and the button that hides it."""
    owners = splash_operators.shown_owners(context)
    sentences = problems.sentences(owners)
    if sentences:
        draw_warnings(layout, context, "\n".join(sentences))
        layout.operator(splash_operators.SPLASH_OT_dismiss.bl_idname, icon="X")


def draw_advice(layout: Any, context: bpy.types.Context, warnings: str) -> None:
    """Show the warnings of the last run, each with the button that does something about it."""
    draw_warnings(layout, context, warnings)
    for operator, icon in (
        (operators.SPLASH_OT_select_strokes, "RESTRICT_SELECT_OFF"),
        (splash_operators.SPLASH_OT_fit_speed, "PREVIEW_RANGE"),
    ):
        if operator.bl_label in warnings:
            layout.operator(operator.bl_idname, icon=icon)


def draw_animated(layout: Any, context: bpy.types.Context, splash: bpy.types.Object) -> None:
    """Say that a splash does not follow what changes over the timeline, with what cures it."""
    line = bake_operators.line_on(splash)
    if not line:
        return
    record = splash.splash_simulation
    if record.is_baked and record.folder:
        layout.label(text=record.summary, icon="RENDER_ANIMATION")
        return
    draw_text(layout, context, line, "INFO")
    layout.operator(bake_operators.SPLASH_OT_bake_frames.bl_idname, icon="RENDER_ANIMATION")


def draw_seed(layout: Any, splash: bpy.types.Object) -> None:
    """Show the seed between the buttons that make the splashes of its neighbours."""
    row = layout.row(align=True)
    name = splash_operators.SPLASH_OT_step_seed.bl_idname
    row.operator(name, text="", icon="TRIA_LEFT").step = -1
    row.prop(splash.splash.settings, "seed")
    row.operator(name, text="", icon="TRIA_RIGHT").step = 1


def draw_follow(layout: Any, splash: bpy.types.Object) -> None:
    """Show whether the splash follows its sketch; no button for parts of models."""
    if splash.splash.sketch is None or splash.splash.owner is not None:
        return
    follows = splash.parent == splash.splash.sketch
    operator = layout.operator(
        splash_operators.SPLASH_OT_follow.bl_idname,
        icon="CHECKBOX_HLT" if follows else "CHECKBOX_DEHLT",
        depress=follows,
    )
    operator.on = not follows


def draw_preparing(layout: Any, context: bpy.types.Context) -> None:
    """Show how far compiling ahead is, which the first look at the tab starts."""
    compile_ahead.ask()
    ahead = compile_ahead.running()
    if ahead is not None:
        layout.progress(factor=ahead.share, text=compile_ahead.PREPARING)
    draw_warnings(layout, context, compile_ahead.note())


def draw_whose(layout: bpy.types.UILayout, item: bpy.types.Object | None) -> None:
    """Say whose settings follow: of a splash or a model, or of splashes yet to be made."""
    if item is None:
        layout.label(text="For new splashes", icon="SCENE_DATA")
    else:
        layout.label(text=item.name, icon="MOD_FLUIDSIM")


def settings_column(layout: Any) -> Any:
    """Add a column for settings: labels beside the values, no buttons for animation."""
    column = layout.column()
    column.use_property_split = True
    column.use_property_decorate = False
    return column


def draw_eye(row: Any, item: Any) -> None:
    """Draw the button that shows or hides an entry of a list."""
    row.prop(item, "show", text="", emboss=False, icon="HIDE_OFF" if item.show else "HIDE_ON")


def draw_warnings(layout: Any, context: bpy.types.Context, warnings: str) -> None:
    """Draw each line of ``warnings`` in a box of its own."""
    for warning in filter(None, warnings.split("\n")):
        row = layout.box().row()
        draw_text(row, context, warning, "ERROR")
        if name := select_named.object_in(warning):
            select_named.draw_button(row, name)


def draw_text(layout: Any, context: bpy.types.Context, text: str, icon: str = "NONE") -> None:
    """Draw ``text`` in as many lines as the width of the region needs."""
    scale = context.preferences.system.ui_scale or 1.0  # 0 without a window
    width = (context.region.width if context.region else 240) / scale
    letters = max(int((width - 60) / PIXELS_PER_LETTER), 20)
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, letters)):
        column.label(text=line, icon=icon if number == 0 else "NONE")


register, unregister = bpy.utils.register_classes_factory(
    (SPLASH_PT_main, SPLASH_PT_settings, SPLASH_PT_info)
)
