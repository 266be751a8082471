# SPDX-License-Identifier: GPL-3.0-or-later
"""Which sketch and which splash are meant by what is active."""

from __future__ import annotations

from typing import NamedTuple

import bpy

from ..data.model import active_part


class Target(NamedTuple):
    """What a run works on; no splash means that a new one is to be made.

    layer : that a new splash is made of; empty for all visible ones
    """

    sketch: bpy.types.Object
    splash: bpy.types.Object | None
    layer: str = ""


def find_target(context: bpy.types.Context) -> Target | None:
    """Return the active sketch and its splash, or the active splash and its sketch."""
    active = context.active_object
    if active is None:
        return None
    if active.type == "GREASEPENCIL":
        return Target(active, splash_of(active, context.scene))
    splash = active_part(active) or active
    if splash.splash.is_splash and splash.splash.sketch is not None:
        return Target(splash.splash.sketch, splash)
    return None


def shown_splash(context: bpy.types.Context) -> bpy.types.Object | None:
    """Return the splash whose settings the panels show and whose refinements the buttons change."""
    active = context.active_object
    if active is not None and active.splash.is_splash:
        return active
    if part := active_part(active):
        return part
    target = find_target(context)
    return target.splash if target is not None else None


def splash_of(sketch: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Return the first splash that is made of the active layer of ``sketch``, or of all layers."""
    found = splashes_of(sketch, scene)
    layer = sketch.data.layers.active
    names = ("",) if layer is None else (layer.name, "")
    return next((item for name in names for item in found if item.splash.layer == name), None)


def splashes_of(sketch: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Return the splashes in the scene that are made of ``sketch`` or of one of its layers."""
    return [
        item for item in scene.objects if item.splash.is_splash and item.splash.sketch == sketch
    ]
