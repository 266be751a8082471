# SPDX-License-Identifier: GPL-3.0-or-later
"""Which sketch and which splash the buttons and panels mean, given the active object."""

from __future__ import annotations

from typing import NamedTuple

import bpy

from ..data import index
from ..data.model import active_part
from ..data.properties import is_splash


class Target(NamedTuple):
    """What to make a splash of. Without a splash a new one is made.

    layer : the one layer to make a new splash of; empty for all visible layers
    """

    sketch: bpy.types.Object
    splash: bpy.types.Object | None
    layer: str = ""


def find_target(context: bpy.types.Context) -> Target | None:
    """Find the active sketch and its splash, or the active splash and its sketch."""
    active = context.active_object
    if active is None:
        return None
    if active.type == "GREASEPENCIL":
        return Target(active, splash_of(active, context.scene))
    splash = active_part(active) or active
    if is_splash(splash) and splash.splash.sketch is not None:
        return Target(splash.splash.sketch, splash)
    return None


def shown_splash(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the splash that the panels show and whose refinements the buttons change."""
    active = context.active_object
    if active is not None and is_splash(active):
        return active
    if part := active_part(active):
        return part
    target = find_target(context)
    return target.splash if target is not None else None


def splash_of(sketch: bpy.types.Object, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the first splash made of the active layer of ``sketch``, else of all its layers."""
    found = splashes_of(sketch, scene)
    layer = sketch.data.layers.active
    names = ("",) if layer is None else (layer.name, "")
    return next((item for name in names for item in found if item.splash.layer == name), None)


def splashes_of(sketch: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """List the splashes in the scene that are made of ``sketch`` or of one of its layers."""
    return [item for item in index.splashes(scene) if item.splash.sketch == sketch]
