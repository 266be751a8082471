# SPDX-License-Identifier: GPL-3.0-or-later
"""The button beside a message that selects the object it is about."""

from __future__ import annotations

import re
from typing import Any

import bpy
from bpy.props import StringProperty

from ..scene.objects import enter_object_mode, select_only

NAMED = re.compile(r"(?<![A-Za-z0-9])'([^']+)'")
"""A name in a message."""


class SPLASH_OT_select_named(bpy.types.Operator):
    """Select the object that this is about"""

    bl_idname = "splash.select_named"
    bl_label = "Select"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    name: StringProperty(name="Name", description="Name of the object", options={"SKIP_SAVE"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Select it, shown or not; where the view layer does not have it, say where it is."""
        item = bpy.data.objects.get(self.name)
        if item is None:
            self.report({"ERROR"}, f"'{self.name}' is gone: it was deleted or renamed")
            return {"CANCELLED"}
        if context.view_layer.objects.get(item.name) != item:
            homes = ", ".join(f"'{home.name}'" for home in item.users_collection) or "no collection"
            self.report(
                {"ERROR"}, f"'{item.name}' is not in this view layer: show its collection {homes}"
            )
            return {"CANCELLED"}
        enter_object_mode(context)
        select_only(context, item)
        if not item.visible_get():
            self.report({"INFO"}, f"'{item.name}' is hidden: show it in the Outliner to select it")
        return {"FINISHED"}


def draw_button(layout: Any, name: str) -> None:
    """Draw the button that selects an object."""
    layout.operator(
        SPLASH_OT_select_named.bl_idname, text="", icon="RESTRICT_SELECT_OFF", emboss=False
    ).name = name


def object_in(message: str) -> str:
    """Return the first name of an object in a message; "" if it names none."""
    return next((name for name in NAMED.findall(message) if name in bpy.data.objects), "")


register, unregister = bpy.utils.register_classes_factory((SPLASH_OT_select_named,))
