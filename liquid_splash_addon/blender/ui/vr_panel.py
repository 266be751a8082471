# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel and the button for drawing in virtual reality."""

from __future__ import annotations

from typing import Any

import bpy

from ..capture import action_set, hands, vr_drawing
from ..capture.bindings import described
from ..jobs import draft_then_full
from .panels import SplashPanel, draw_text, draw_warnings, settings_column

NO_XR = "This Blender was built without virtual reality"
NO_RUNTIME = (
    "No VR runtime answered: start SteamVR, the Meta app, Monado or the like, connect the headset, "
    "then try again"
)


class SPLASH_OT_vr_drawing(bpy.types.Operator):
    """Draw strokes with tracked controllers, in virtual reality"""

    bl_idname = "splash.vr_drawing"
    bl_label = "Draw in VR"
    bl_description = (
        "Start a VR session in which the triggers of the controllers draw strokes, or end it. In "
        "a session that is running already, only drawing starts and ends"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether this Blender can, and there is a window."""
        if not bpy.app.build_options.xr_openxr:
            cls.poll_message_set(NO_XR)
            return False
        if hands.is_ending(context):
            cls.poll_message_set("The last VR session is still ending")
            return False
        return not bpy.app.background

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Start or end."""
        drawing = vr_drawing.current()
        if drawing is not None:
            vr_drawing.stop(context)
            if drawing.owns_session and hands.is_running(context):
                bpy.ops.wm.xr_session_toggle()
            return {"FINISHED"}
        is_ours = not hands.is_running(context)
        if is_ours and not self.start_session(context):
            self.report({"ERROR"}, NO_RUNTIME)
            return {"CANCELLED"}
        if not action_set.is_there(context.window_manager.xr_session_state):
            self.report({"ERROR"}, vr_drawing.NO_SET)
            return {"CANCELLED"}
        vr_drawing.start(context, is_ours)
        return {"FINISHED"}

    def start_session(self, context: bpy.types.Context) -> bool:
        """Start a session; False if no runtime answers."""
        try:
            bpy.ops.wm.xr_session_toggle()
        except RuntimeError:  # as which a script gets what Blender reports to a user
            return False
        return hands.is_running(context)


class SPLASH_PT_vr(SplashPanel, bpy.types.Panel):
    """Drawing in virtual reality."""

    bl_label = "VR"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012
    bl_order = 20

    def draw(self, context: bpy.types.Context) -> None:
        """Show the button, what is going on, and what the controllers' buttons do."""
        layout = self.layout
        drawing = vr_drawing.current()
        label, icon = ("Draw in VR", "PLAY") if drawing is None else ("Stop", "SNAP_FACE")
        layout.operator(SPLASH_OT_vr_drawing.bl_idname, text=label, icon=icon)
        draw_state(layout, context)
        settings = context.scene.splash_capture
        column = settings_column(layout)
        column.prop(settings, "tip")
        column.prop(settings, "controller")
        grid = layout.grid_flow(row_major=True, columns=2, even_columns=True)
        for does, button in described(settings.controller):
            grid.label(text=does)
            grid.label(text=button)


def draw_state(layout: Any, context: bpy.types.Context) -> None:
    """Show the state of the runtime, of drawing and of the splash that was asked for."""
    if not bpy.app.build_options.xr_openxr:
        draw_text(layout, context, NO_XR, "ERROR")
        return
    draw_text(layout, context, state_in_words(context), "INFO")
    draw_warnings(layout, context, vr_drawing.note())
    making = draft_then_full.making()
    if making is not None and making.is_busy:
        stage, fraction = making.progress
        layout.progress(factor=fraction, text=f"{making.stage.capitalize()}: {stage}")


def state_in_words(context: bpy.types.Context) -> str:
    """Return what the session is doing."""
    drawing = vr_drawing.current()
    if drawing is None:
        return "VR session running, not drawing" if hands.is_running(context) else "No VR session"
    if not any(drawing.poses):
        return "Waiting for the headset and the controllers"
    if drawing.message is not None:
        return f"Drawing: {drawing.message.text}"
    return "Drawing: hold a trigger to draw"


register, unregister = bpy.utils.register_classes_factory((SPLASH_OT_vr_drawing, SPLASH_PT_vr))
