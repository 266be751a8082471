# SPDX-License-Identifier: GPL-3.0-or-later
"""A studio around liquid at one click: Blender's default scene hardly shows water."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty
from mathutils import Vector

from ..data.model import is_model
from ..data.properties import is_splash
from ..scene import drop_points, places, studio
from ..scene.targets import shown_liquid

FRONT = (0.25, 1.0, -0.28)
"""The way the camera looks where there is no view to take it from."""

LOWEST = -0.12
"""Upward part of the flattest view: from further below, the table would hide the liquid."""


class SPLASH_OT_studio(bpy.types.Operator):
    """Put a glowing table, strip lights and a camera around the selected splashes"""

    bl_description = (
        "Put a dark table that glows behind the liquid, strip lights and a camera around the "
        "selected splashes: water is seen by what is around it. Again: move them here, to this "
        "view. The world that the scene had stays in the file; EEVEE traces rays from then on"
    )
    bl_idname = "splash.studio"
    bl_label = "Add Studio"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    glow: EnumProperty(
        items=[
            ("BLUE", "Blue", "Cool light behind the liquid: for water and ink"),
            ("WARM", "Warm", "Warm light behind the liquid: for wine, honey and milk"),
        ],
        name="Glow",
        description="Colour of the light behind the liquid",
    )
    camera: BoolProperty(
        name="Camera",
        description="Add a camera that sees all of the liquid from where you look, and render "
        "through it; the scene's own stays in the file",
        default=True,
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Build it, or build it anew."""
        points = points_of(liquids_shown(context))
        if not len(points):
            self.report({"ERROR"}, "Select a splash first: the studio is built around it")
            return {"CANCELLED"}
        margin = studio.MARGIN if self.camera else None
        studio.build(context.scene, points, view_of(context), studio.GLOWS[self.glow], margin)
        self.report({"INFO"}, "Press F12 to render" if self.camera else "The studio is there")
        return {"FINISHED"}


def liquids_shown(context: bpy.types.Context) -> list[bpy.types.Object]:
    """Return the selected splashes and models, else the one that the panel shows."""
    chosen = [item for item in context.selected_objects if is_splash(item) or is_model(item)]
    shown = shown_liquid(context)
    return chosen or ([] if shown is None else [shown])


def points_of(items: list[bpy.types.Object]) -> np.ndarray:
    """Return the vertices of objects and of their drops, in the world, float64 ``(n, 3)``."""
    found = [np.zeros((0, 3))]
    for item in items:
        for part in filter(None, (item, drop_points.own_points(item))):
            local = np.empty((len(part.data.vertices), 3), dtype=np.float32)
            part.data.vertices.foreach_get("co", local.ravel())
            place = np.array(places.world_matrix(part))
            found.append(local @ place[:3, :3].T + place[:3, 3])
    return np.concatenate(found)


def view_of(context: bpy.types.Context) -> Vector:
    """Return the way that the artist looks, turned down where it would see the table from below.

    In a script, and in the background, it is one of the front.
    """
    area = context.area
    region = area.spaces.active.region_3d if area is not None and area.type == "VIEW_3D" else None
    view = Vector(FRONT) if region is None else region.view_rotation @ Vector((0, 0, -1))
    if view.z > LOWEST:
        view.z = 0.0
        view = view.normalized() if view.length > 1e-6 else Vector((0, 1, 0))
        view.z = LOWEST
    return view.normalized()


register, unregister = bpy.utils.register_classes_factory((SPLASH_OT_studio,))
