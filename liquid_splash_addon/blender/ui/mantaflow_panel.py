# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own solver in the Splash tab: settings, Export, Bake, and what became of it."""

from __future__ import annotations

from typing import Any

import bpy

from ...core.mantaflow.settings import BYTES_PER_CELL
from ..jobs import bake_mantaflow
from ..jobs.export_mantaflow import reason_to_export
from ..scene import fluid_domain
from . import mantaflow_operators as operators
from .panels import SplashPanel, draw_warnings, settings_column


class SPLASH_PT_mantaflow(SplashPanel, bpy.types.Panel):
    """The domain of the active splash or model."""

    bl_label = "Mantaflow"
    bl_parent_id = "SPLASH_PT_main"
    bl_order = 4
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: bpy.types.Context) -> None:
        """Show the settings and the next thing to do."""
        layout = self.layout
        item, domain = operators.exported_item(context), operators.shown_domain(context)
        group = context.scene.splash_mantaflow if domain is None else domain.splash_domain
        if item is not None:
            layout.label(text=item.name, icon="MOD_FLUIDSIM")
        draw_settings(settings_column(layout), group.settings)
        if domain is None:
            layout.operator(operators.SPLASH_OT_mantaflow_export.bl_idname, icon="EXPORT")
            return
        draw_domain(layout, context, domain)


def draw_settings(column: Any, settings: Any) -> None:
    """Show the sliders."""
    for name in ("resolution", "margin", "frame", "frames", "ground"):
        column.prop(settings, name)
    if settings.ground != "NONE":
        column.prop(settings, "ground_height")
    if settings.ground == "POOL":
        column.prop(settings, "pool_depth")
    for name in ("gravity", "divergence_free", "mesh", "hide"):
        column.prop(settings, name)
    most = BYTES_PER_CELL * settings.resolution**3 / 2**30
    column.label(text=f"Needs {most:.1f} GB of memory at most", icon="MEMORY")


def draw_domain(layout: Any, context: bpy.types.Context, domain: bpy.types.Object) -> None:
    """Show what was exported and baked, and the buttons that go on from there."""
    group, fluid = domain.splash_domain, fluid_domain.settings_of(domain)
    layout.label(text=group.summary, icon="OBJECT_DATA")
    if group.removed > 0:
        was = "Removed" if group.settings.divergence_free else "The first step will remove"
        layout.label(text=f"{was}: {group.removed:.0%} of the velocity (it diverged)")
    if fluid_domain.is_baking(fluid):
        layout.label(text="Baking: Esc stops, what is done is kept")
        return
    reason = reason_to_export(domain, context.scene)
    if reason:
        layout.label(text=reason, icon="ERROR")
        layout.operator(
            operators.SPLASH_OT_mantaflow_export.bl_idname, text="Export Again", icon="EXPORT"
        )
        return
    row = layout.row(align=True)
    done = bake_mantaflow.last_frame(domain)
    if done < fluid.cache_frame_end:
        text = "Bake" if done == group.frame else "Resume"
        row.operator(operators.SPLASH_OT_mantaflow_bake.bl_idname, text=text, icon="PHYSICS")
    elif fluid.use_mesh and not fluid.has_cache_baked_mesh:
        row.operator(operators.SPLASH_OT_mantaflow_bake.bl_idname, text="Bake Mesh", icon="PHYSICS")
    row.operator(
        operators.SPLASH_OT_mantaflow_export.bl_idname, text="Export Again", icon="FILE_REFRESH"
    )
    if done > group.frame:
        layout.label(text=f"{done - group.frame} of {fluid.cache_frame_end - group.frame} frames")
        layout.operator(operators.SPLASH_OT_mantaflow_verify.bl_idname, icon="VIEWZOOM")
    for line in filter(None, group.verified.split(", ")):
        layout.label(text=line)
    draw_warnings(layout, context, group.warnings)


register, unregister = bpy.utils.register_classes_factory((SPLASH_PT_mantaflow,))
