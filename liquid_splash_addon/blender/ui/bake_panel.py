# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames that are baked, in the Splash tab: which, of what, and what has become of them."""

from __future__ import annotations

import bpy

from ..scene.keyed import count_drawings
from ..scene.targets import shown_splash
from . import bake_operators, simulate_operators
from .panels import SplashPanel, settings_column
from .simulate_panel import draw_files


class SPLASH_PT_bake(SplashPanel, bpy.types.Panel):
    """A splash for each frame."""

    bl_label = "Bake Frames"
    bl_parent_id = "SPLASH_PT_main"
    bl_order = 6
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash."""
        return shown_splash(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Show which frames, of which drawings, the button, and the result."""
        layout, splash = self.layout, shown_splash(context)
        record = splash.splash_simulation
        column = settings_column(layout)
        column.prop(record.bake, "range")
        if record.bake.range == "OWN":
            column.prop(record.bake, "first")
            column.prop(record.bake, "last")
        drawings = column.column()
        drawings.active = count_drawings(splash) > 1
        drawings.prop(record.bake, "drawings")
        button = layout.row()
        button.scale_y = 1.3
        button.operator(bake_operators.SPLASH_OT_bake_frames.bl_idname, icon="RENDER_ANIMATION")
        if record.is_baked:
            draw_files(layout, context, splash)
            layout.operator(simulate_operators.SPLASH_OT_simulation_delete.bl_idname, icon="TRASH")


register, unregister = bpy.utils.register_classes_factory((SPLASH_PT_bake,))
