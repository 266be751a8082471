# SPDX-License-Identifier: GPL-3.0-or-later
"""The Splash tab in the 3D viewport's sidebar."""

from __future__ import annotations

import textwrap
from dataclasses import fields
from typing import Any

import bpy

from ...core.settings import SplashSettings
from ..jobs import dependencies, job
from ..scene.targets import shown_splash
from . import model_operators, operators, sketch_presets

SLIDERS = {"variation", "surface_threshold"}
PIXELS_A_LETTER = 6.5
"""Width of a letter of the interface font at scale 1, for wrapping text by hand."""


class SplashPanel:
    """What the panels of the tab share."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Splash"


class SPLASH_PT_main(SplashPanel, bpy.types.Panel):
    """The buttons."""

    bl_label = "Liquid Splash"

    def draw(self, context: bpy.types.Context) -> None:
        """Show the buttons, or how far the running splash is."""
        layout = self.layout
        draw_missing(layout, context)
        row = layout.row(align=True)
        row.operator(operators.SPLASH_OT_new_sketch.bl_idname, icon="GREASEPENCIL")
        row.menu(sketch_presets.SPLASH_MT_preset_sketches.bl_idname)
        main = layout.column()
        main.scale_y = 1.5
        if job.running is None:
            main.operator(operators.SPLASH_OT_generate.bl_idname, icon="MOD_FLUIDSIM")
        else:  # in the button's place, so that nothing moves
            main.progress(factor=job.running.fraction, text=f"{job.running.stage} (Esc stops)")
        row = layout.row(align=True)
        row.operator(operators.SPLASH_OT_regenerate.bl_idname, icon="FILE_REFRESH")
        row.operator(operators.SPLASH_OT_realign.bl_idname, icon="ORIENTATION_LOCAL")
        row = layout.row(align=True)
        row.operator(model_operators.SPLASH_OT_generate_layers.bl_idname, icon="RENDERLAYERS")
        row.operator(model_operators.SPLASH_OT_combine.bl_idname, icon="MOD_BOOLEAN")


class SPLASH_PT_settings(SplashPanel, bpy.types.Panel):
    """The settings of the active splash, or those for new ones."""

    bl_label = "Settings"
    bl_parent_id = "SPLASH_PT_main"

    def draw(self, context: bpy.types.Context) -> None:
        """Show whose settings they are, then the settings."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        splash = shown_splash(context)
        if splash is None:
            layout.label(text="For new splashes", icon="SCENE_DATA")
        else:
            layout.label(text=splash.name, icon="MOD_FLUIDSIM")
        group = (context.scene if splash is None else splash).splash.settings
        column = layout.column()
        for item in fields(SplashSettings):
            column.prop(group, item.name, slider=item.name in SLIDERS)


class SPLASH_PT_info(SplashPanel, bpy.types.Panel):
    """What the last run had to say."""

    bl_label = "Last Run"
    bl_parent_id = "SPLASH_PT_main"
    bl_order = 9

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there was one."""
        return shown_splash(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Show the result in a line, then the warnings."""
        layout = self.layout
        memory = shown_splash(context).splash
        layout.label(text=memory.summary)
        layout.label(text=f"{memory.device}, {memory.precision}, weights {memory.weights_hash[:8]}")
        for warning in filter(None, memory.warnings.split("\n")):
            draw_text(layout.box(), context, warning, "ERROR")
        layout.use_property_split = True
        layout.prop(memory, "sketch")
        if memory.sketch is not None:
            layout.prop_search(memory, "layer", memory.sketch.data, "layers")


def draw_missing(layout: Any, context: bpy.types.Context) -> None:
    """Say what to install where the generator cannot run."""
    missing = dependencies.missing_packages()
    if not missing:
        return
    box = layout.box()
    text = f"Not installed: {', '.join(missing)}. Run this in a terminal, then restart Blender:"
    draw_text(box, context, text, "ERROR")
    draw_text(box, context, dependencies.install_command())
    box.operator(operators.SPLASH_OT_copy_install_command.bl_idname, icon="COPYDOWN")


def draw_text(layout: Any, context: bpy.types.Context, text: str, icon: str = "NONE") -> None:
    """Draw ``text`` over as many lines as the region's width needs."""
    scale = context.preferences.system.ui_scale or 1.0  # 0 without a window
    width = (context.region.width if context.region else 240) / scale
    letters = max(int((width - 60) / PIXELS_A_LETTER), 20)
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, letters)):
        column.label(text=line, icon=icon if number == 0 else "NONE")


register, unregister = bpy.utils.register_classes_factory(
    (SPLASH_PT_main, SPLASH_PT_settings, SPLASH_PT_info)
)
