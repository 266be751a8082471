# SPDX-License-Identifier: GPL-3.0-or-later
"""What the active splash or model is made of, in the Splash tab: liquid, material, attributes."""

from __future__ import annotations

import bpy

from ...core.liquids import LIQUIDS
from ..data.properties import is_splash
from ..scene.liquid_materials import liquid_of, needs_attributes
from ..scene.targets import shown_liquid
from .liquid_operators import SPLASH_OT_liquid
from .panels import SplashPanel, draw_whose, settings_column
from .studio_operators import SPLASH_OT_studio


class SPLASH_PT_look(SplashPanel, bpy.types.Panel):
    """Liquid and material of a splash or a model, or the liquid of those yet to be made."""

    bl_label = "Look"
    bl_parent_id = "SPLASH_PT_main"
    bl_order = 2
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: bpy.types.Context) -> None:
        """Show the menu of liquids; then what it sets, each to be changed alone."""
        layout = self.layout
        item = shown_liquid(context)
        draw_whose(layout, item)
        if item is None:
            chosen = context.scene.splash.settings.liquid
            draw_menu(layout, LIQUIDS[chosen].label)
            return
        slots = item.material_slots
        name = liquid_of(slots[0].material) if slots else None
        draw_menu(layout, LIQUIDS[name].label if name else "Liquid")
        column = settings_column(layout)
        if slots:
            column.prop(slots[0], "material", text="Material")
        if is_splash(item):
            column.prop(item.splash.settings, "liquid", text="Flows Like")
        group = item.splash_look
        column.prop(group, "stroke_colours")
        row = column.row()
        if needs_attributes(item) or group.stroke_colours:
            row.label(text="Shader Attributes: on, the material needs them", icon="CHECKMARK")
        else:
            row.prop(group, "attributes")
        layout.operator(SPLASH_OT_studio.bl_idname, icon="LIGHT_AREA")


def draw_menu(layout: bpy.types.UILayout, text: str) -> None:
    """Draw the menu of liquids."""
    layout.operator_menu_enum(SPLASH_OT_liquid.bl_idname, "liquid", text=text, icon="MATERIAL")


register, unregister = bpy.utils.register_classes_factory((SPLASH_PT_look,))
