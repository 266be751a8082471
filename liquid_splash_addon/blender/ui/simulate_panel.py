# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulation in the Splash tab: what it will take, its button, and what has become of it."""

from __future__ import annotations

from typing import Any

import bpy

from ...core.playback.files import MANIFEST
from ..jobs import estimates, simulate, work_queue
from ..scene import frame_folder
from . import simulate_operators as operators
from .panels import SplashPanel, draw_text, draw_warnings, settings_column

ALWAYS = ("frames", "resolution")
"""Settings that every user looks at; the others are below, by use."""


class SPLASH_PT_simulation(SplashPanel, bpy.types.Panel):
    """How the active splash or model moves on."""

    bl_label = "Simulation"
    bl_parent_id = "SPLASH_PT_main"
    bl_order = 5
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash or a model."""
        return operators.simulated_item(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Show the settings in the order of their use, the button, and the result."""
        layout = self.layout
        item = operators.simulated_item(context)
        record = item.splash_simulation
        settings = record.settings
        column = settings_column(layout)
        column.prop(record, "start")
        for name in ALWAYS:
            column.prop(settings, name)
        draw_ground(column, record)
        draw_button(layout, context, item)
        draw_state(layout, context, item)


class SPLASH_PT_simulation_more(SplashPanel, bpy.types.Panel):
    """What few users change."""

    bl_label = "More"
    bl_parent_id = "SPLASH_PT_simulation"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash or a model."""
        return operators.simulated_item(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Show forces, steps, and what is evaluated on every frame."""
        record = operators.simulated_item(context).splash_simulation
        settings, column = record.settings, settings_column(self.layout)
        row = column.row(heading="Gravity")
        row.prop(settings, "gravity", text="")
        strength = row.row()
        strength.active = settings.gravity
        strength.prop(settings, "gravity_strength", text="")
        for name in ("tension", "least_substeps", "margin"):
            column.prop(settings, name)
        every = column.column(heading="On Every Frame")
        for name in ("waves", "droplets"):
            every.prop(record.playback, name)
        self.layout.operator(operators.SPLASH_OT_simulation_delete.bl_idname, icon="TRASH")


def draw_ground(column: Any, record: Any) -> None:
    """Show what lies below, and where."""
    settings = record.settings
    column.prop(settings, "ground")
    if settings.ground == "NONE":
        return
    column.prop(record, "ground_object")
    height = column.row()
    height.active = record.ground_object is None
    height.prop(settings, "ground_height")
    if settings.ground == "POOL":
        column.prop(settings, "pool_depth")


def draw_button(layout: Any, context: bpy.types.Context, item: bpy.types.Object) -> None:
    """Show what it will take and the button; while it runs, how far it is."""
    entry = work_queue.collecting(beside=True)
    if entry is not None:
        row = layout.row(align=True)
        row.scale_y = 1.3
        row.progress(factor=entry.fraction, text=entry.stage)
        row.operator(operators.SPLASH_OT_simulation_stop.bl_idname, text="", icon="X")
        return
    expected = estimates.of(item, context.scene)
    if expected:
        draw_text(layout, context, expected)
    button = layout.row()
    button.scale_y = 1.3
    button.operator(
        operators.SPLASH_OT_simulate.bl_idname, text=label_of(item, context.scene), icon="PLAY"
    )


def label_of(item: bpy.types.Object, scene: bpy.types.Scene) -> str:
    """Return what pressing the button would do."""
    record = item.splash_simulation
    if not record.folder or record.is_baked or not is_there(item):
        return operators.SPLASH_OT_simulate.bl_label
    if record.made_of != simulate.made_of(item, scene):
        return "Simulate Again"
    if record.frames < record.wanted:
        return f"Resume after Frame {record.frames - 1} of {record.wanted - 1}"
    return operators.SPLASH_OT_simulate.bl_label


def is_there(item: bpy.types.Object) -> bool:
    """Whether the folder of its frames is."""
    folder = frame_folder.folder_of(item)
    return folder is not None and (folder / MANIFEST).is_file()


def draw_state(layout: Any, context: bpy.types.Context, item: bpy.types.Object) -> None:
    """Show what has been simulated, and what the user should know of it."""
    record = item.splash_simulation
    if record.is_baked:
        draw_text(layout, context, "Its frames are baked: simulating replaces them", "INFO")
        return
    draw_files(layout, context, item)
    if (
        record.summary
        and is_there(item)
        and record.made_of != simulate.made_of(item, context.scene)
    ):
        draw_text(layout, context, "Out of date: the splash or a setting was changed", "INFO")


def draw_files(layout: Any, context: bpy.types.Context, item: bpy.types.Object) -> None:
    """Show what files there are, simulated or baked, and what the user should know of them."""
    record = item.splash_simulation
    if not bpy.data.filepath:
        text = "The file is not saved: frames will be kept in a temporary folder"
        draw_text(layout, context, text, "INFO")
    elif frame_folder.is_temporary(record.folder):
        draw_text(layout, context, "The frames are in a temporary folder", "ERROR")
        layout.operator(operators.SPLASH_OT_simulation_keep.bl_idname, icon="FILE_FOLDER")
    if record.folder and not is_there(item):
        text = f"The frames are not in {record.folder} any more: make them again, or put them back"
        draw_text(layout.box(), context, text, "ERROR")
    elif record.summary:
        layout.label(text=record.summary)
    draw_warnings(layout, context, record.warnings)


register, unregister = bpy.utils.register_classes_factory(
    (SPLASH_PT_simulation, SPLASH_PT_simulation_more)
)
