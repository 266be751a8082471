# SPDX-License-Identifier: GPL-3.0-or-later
"""Which sketch and which splash the buttons and panels mean, given the active object."""

from __future__ import annotations

from typing import NamedTuple

import bpy

from ..data import index
from ..data.model import active_part, is_model
from ..data.properties import STROKE_TYPES, is_splash


class Target(NamedTuple):
    """What to make a splash of. Without a splash a new one is made.

    A sketch may be several objects: its place is that of the first, ``sketch``.

    layer : the one layer to make a new splash of; empty for all visible layers
    others : further objects whose strokes belong to the sketch
    """

    sketch: bpy.types.Object
    splash: bpy.types.Object | None
    layer: str = ""
    others: tuple[bpy.types.Object, ...] = ()


def find_target(context: bpy.types.Context) -> Target | None:
    """Find the active sketch and its splash, or the active splash and its sketch.

    Other selected objects with strokes belong to the sketch: its splash is the one that is made of
    exactly these objects.
    """
    active = context.active_object
    if active is None:
        return None
    if active.type in STROKE_TYPES:
        others = selected_sketches(context, active)
        splash = splash_of(active, context.scene, others)
        return Target(active, None, "", others) if splash is None else target_of(splash)
    splash = active_part(active) or active
    return target_of(splash) if is_splash(splash) and splash.splash.sketch is not None else None


def chosen_sketches(context: bpy.types.Context) -> tuple[bpy.types.Object, ...]:
    """Return the active sketch and the others that are selected, or what the splash is made of."""
    active, target = context.active_object, find_target(context)
    if active is not None and active.type in STROKE_TYPES:
        return (active, *selected_sketches(context, active))
    return () if target is None else (target.sketch, *target.others)


def target_of(splash: bpy.types.Object) -> Target:
    """Return a splash with all that it is made of."""
    return Target(splash.splash.sketch, splash, splash.splash.layer, others_of(splash))


def others_of(splash: bpy.types.Object) -> tuple[bpy.types.Object, ...]:
    """Return what a splash is made of beside its sketch, without objects that were deleted."""
    found = [entry.sketch for entry in splash.splash.others]
    return tuple(item for item in found if item is not None and item.users_scene)


def lost_objects(
    splash: bpy.types.Object | None, others: tuple[bpy.types.Object, ...]
) -> list[str]:
    """Return a warning if objects were deleted whose strokes belonged to a splash."""
    known = [] if splash is None else [entry for entry in splash.splash.others if entry.sketch]
    lost = len(known) - len(others)
    return [f"{lost} object(s) of the sketch were deleted: made without them"] if lost > 0 else []


def selected_sketches(
    context: bpy.types.Context, active: bpy.types.Object
) -> tuple[bpy.types.Object, ...]:
    """Return the other selected objects with strokes: in Object Mode, where many can be chosen."""
    if active.mode != "OBJECT" or not active.select_get():
        return ()
    selected = context.selected_objects
    return tuple(item for item in selected if item.type in STROKE_TYPES and item != active)


def shown_splash(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the splash that the panels show and whose refinements the buttons change."""
    active = context.active_object
    if active is not None and is_splash(active):
        return active
    if part := active_part(active):
        return part
    target = find_target(context)
    return target.splash if target is not None else None


def shown_liquid(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the model or splash that the panels show: the active model, else the shown splash."""
    active = context.active_object
    return active if is_model(active) else shown_splash(context)


def splash_of(
    sketch: bpy.types.Object, scene: bpy.types.Scene, others: tuple[bpy.types.Object, ...] = ()
) -> bpy.types.Object | None:
    """Find the splash that is made of ``sketch`` and ``others``.

    Of a sketch alone it is the first one made of its active layer, else of all its layers, else
    one that it has only a part in.
    """
    if others:
        wanted = {sketch, *others}
        return next((item for item in index.splashes(scene) if made_of(item) == wanted), None)
    found = splashes_of(sketch, scene)
    layer = sketch.data.layers.active if sketch.type == "GREASEPENCIL" else None
    names = ("",) if layer is None else (layer.name, "")
    alone = [item for item in found if not others_of(item)]
    for name in names:
        if match := next((item for item in alone if item.splash.layer == name), None):
            return match
    return next((item for item in index.splashes(scene) if sketch in made_of(item)), None)


def made_of(splash: bpy.types.Object) -> set[bpy.types.Object]:
    """Return the objects that a splash is made of; empty for one that is made of a layer."""
    record = splash.splash
    return set() if record.layer else {record.sketch, *others_of(splash)} - {None}


def splashes_of(sketch: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """List the splashes in the scene that are made of ``sketch`` or of one of its layers."""
    return [item for item in index.splashes(scene) if item.splash.sketch == sketch]
