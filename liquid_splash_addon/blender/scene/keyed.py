# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a splash changes over the timeline: keyed and driven settings, animated sketches.

A splash is made by a button, so it does not follow them by itself.
"""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from .targets import others_of

OWN = ("splash.settings.", "splash_stack.", "splash_obstacles.", "splash_motion.time_scale")
"""Beginnings of the paths of a splash's properties that its frames are made of."""

LAYERS = ("layers[", "layer_groups[", "materials[", "attributes[")
"""Those of a sketch's data."""

TIMED = ("GREASE_PENCIL_BUILD", "GREASE_PENCIL_TIME", "GREASE_PENCIL_NOISE")
"""Modifiers that do something else at every frame, without keys."""


def has_keyed_settings(splash: bpy.types.Object) -> bool:
    """Whether settings of a splash, of its refinements or of its sketch's layers are animated."""
    if any(path.startswith(OWN) for path in animated_paths(splash)):
        return True
    counts = splash.splash.settings.use_modifiers
    return any(
        any(path.startswith(LAYERS) for path in animated_paths(item.data))
        or (counts and is_modified_over_time(item))
        for item in sketches_of(splash)
    )


def is_modified_over_time(sketch: bpy.types.Object) -> bool:
    """Whether the modifiers of a sketch change with the frame."""
    if any(path.startswith("modifiers[") for path in animated_paths(sketch)):
        return True
    return any(modifier.type in TIMED and modifier.show_viewport for modifier in sketch.modifiers)


def count_drawings(splash: bpy.types.Object) -> int:
    """Return how many drawings the layers of a splash's sketch have one after the other."""
    return max((len(frames) for frames in frames_of_layers(splash)), default=0)


def frames_of_layers(splash: bpy.types.Object) -> Iterator[set[int]]:
    """Yield the frames at which each object of a splash's sketch has another drawing."""
    for item in sketches_of(splash):
        if item.type == "GREASEPENCIL":
            yield {frame.frame_number for layer in item.data.layers for frame in layer.frames}


def sketches_of(splash: bpy.types.Object) -> list[bpy.types.Object]:
    """List the objects whose strokes a splash is made of."""
    sketch = splash.splash.sketch
    return [item for item in (sketch, *others_of(splash)) if item is not None]


def animated_paths(owner: bpy.types.ID) -> Iterator[str]:
    """Yield the paths of the properties of a data-block that keys, strips or drivers move."""
    animation = owner.animation_data
    if animation is None:
        return
    yield from (curve.data_path for curve in animation.drivers)
    yield from paths_in(animation.action, animation.action_slot)
    for track in animation.nla_tracks:
        for strip in track.strips:
            yield from paths_in(strip.action, strip.action_slot)


def paths_in(action: bpy.types.Action | None, slot: bpy.types.ActionSlot | None) -> Iterator[str]:
    """Yield the paths that a slot of an action moves."""
    if action is None or slot is None:
        return
    for layer in action.layers:
        for strip in layer.strips:
            channels = strip.channelbag(slot)
            if channels is not None:
                yield from (curve.data_path for curve in channels.fcurves)
