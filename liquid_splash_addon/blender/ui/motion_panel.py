# SPDX-License-Identifier: GPL-3.0-or-later
"""The motion of the active splash or model in the Splash tab: slow motion, preview, blur."""

from __future__ import annotations

import bpy

from ...core.settings import MotionSettings
from ..data.properties import to_settings
from ..scene import ballistics
from ..scene.targets import shown_liquid
from . import motion_operators as operators
from .export_vdb import SPLASH_OT_export_vdb
from .panels import SplashPanel, draw_whose, settings_column


class SPLASH_PT_motion(SplashPanel, bpy.types.Panel):
    """How fast a splash or a model moves, or those will that are yet to be made."""

    bl_label = "Motion"
    bl_parent_id = "SPLASH_PT_main"
    bl_order = 3
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: bpy.types.Context) -> None:
        """Show whose motion it is, its speed, the preview, and the scene's motion blur."""
        layout = self.layout
        item = shown_liquid(context)
        draw_whose(layout, item)
        group = (context.scene if item is None else item).splash_motion
        column = settings_column(layout)
        column.prop(group, "time_scale")
        row = column.row()
        row.alignment = "RIGHT"
        row.label(text=to_settings(group, MotionSettings).speed_label)
        if item is not None:
            draw_preview(layout, item)
            layout.operator(operators.SPLASH_OT_two_pose_mesh.bl_idname, icon="SHAPEKEY_DATA")
            layout.operator(
                SPLASH_OT_export_vdb.bl_idname, text="Export Volume", icon="VOLUME_DATA"
            )
        column = settings_column(layout)
        render = context.scene.render
        column.prop(render, "use_motion_blur")
        row = column.row()
        row.active = render.use_motion_blur
        row.prop(render, "motion_blur_shutter")


def draw_preview(layout: bpy.types.UILayout, item: bpy.types.Object) -> None:
    """Show the button of the ballistic preview, or its settings where it is on."""
    if ballistics.modifier_of(item) is None:
        layout.operator(operators.SPLASH_OT_ballistic_preview.bl_idname, icon="FORCE_FORCE")
        return
    box = layout.box()
    row = box.row()
    row.label(text=operators.SPLASH_OT_ballistic_preview.bl_label)
    row.operator(operators.SPLASH_OT_ballistic_remove.bl_idname, text="", icon="X")
    column = settings_column(box)
    column.prop(item.splash_motion, "shape_frame")
    column.prop(item.splash_motion, "gravity")


register, unregister = bpy.utils.register_classes_factory((SPLASH_PT_motion,))
