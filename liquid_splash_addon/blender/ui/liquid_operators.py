# SPDX-License-Identifier: GPL-3.0-or-later
"""Choosing what flows: a liquid's material and physics."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty

from ...core.liquids import ITEMS
from ..data.model import is_model, splashes_in
from ..data.properties import is_splash
from ..jobs import scheduler
from ..scene import drop_points
from ..scene.liquid_materials import give, material_of
from ..scene.objects import SceneError, check_writable
from ..scene.targets import shown_liquid


class SPLASH_OT_liquid(bpy.types.Operator):
    """Make the selected splashes and models another liquid"""

    bl_description = (
        "Give the selected splashes and models a liquid's material, shared by all that have it, "
        "and its surface tension and viscosity. Without any, it is for new splashes"
    )
    bl_idname = "splash.liquid"
    bl_label = "Choose Liquid"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    liquid: EnumProperty(items=ITEMS, name="Liquid", description="What flows")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Set material and physics of all that can be changed; report the others."""
        chosen = liquids_meant(context)
        if not chosen:
            context.scene.splash.settings.liquid = self.liquid
            return {"FINISHED"}
        left_out = []
        with scheduler.held():
            for item in chosen:
                try:
                    become(item, self.liquid)
                except SceneError as error:
                    left_out.append(str(error))
        for sentence in left_out:
            self.report({"WARNING"}, f"{sentence}. It stays as it is")
        return {"CANCELLED"} if len(left_out) == len(chosen) else {"FINISHED"}


def liquids_meant(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Return the splash or model that the panel shows, and the others that are selected."""
    selected = [item for item in context.selected_objects if is_splash(item) or is_model(item)]
    shown = shown_liquid(context)
    return selected if shown is None or shown in selected else [shown, *selected]


def become(item: bpy.types.Object, liquid: str) -> None:
    """Make a splash or a model, its parts and its drops a liquid. Raises SceneError."""
    check_writable(item)
    material = material_of(liquid)
    for part in [item, *(splashes_in(item) if is_model(item) else [])]:
        if part.is_editable and part.data.is_editable:
            give(part, material)
            drop_points.give(part, material)
            if is_splash(part):
                part.splash.settings.liquid = liquid
    scheduler.request(item)  # attributes that the material needs


register, unregister = bpy.utils.register_classes_factory((SPLASH_OT_liquid,))
