# SPDX-License-Identifier: GPL-3.0-or-later
"""What a splash and a scene remember; made from core's one list of parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import Field, fields
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...core.settings import Settings, SplashSettings

IDENTITY = tuple(float(row == column) for column in range(4) for row in range(4))


def settings_properties(kind: type[Settings] = SplashSettings, **extra: Any) -> dict[str, Any]:
    """Return a Blender property for every field of a ``kind`` of settings, by name.

    extra : passed on to each, such as ``options={"SKIP_SAVE"}``.
    """
    return {item.name: blender_property(item, extra) for item in fields(kind)}


def blender_property(item: Field[Any], extra: dict[str, Any]) -> Any:
    """Return the Blender property that shows one field of some settings."""
    limits = item.metadata
    about = {
        "name": limits["label"],
        "description": limits["description"],
        "default": item.default,
        **extra,
    }
    if "items" in limits:
        return EnumProperty(items=limits["items"], **about)
    if isinstance(item.default, bool):
        return BoolProperty(**about)
    kind: Callable[..., Any] = IntProperty if isinstance(item.default, int) else FloatProperty
    if kind is FloatProperty:
        about |= {"step": 1, "precision": 4 if limits["high"] <= 0.1 else 3}
    if "soft" in limits:
        about["soft_max"] = limits["soft"]
    return kind(min=limits["low"], max=limits["high"], **about)


def to_settings(group: Any, kind: type[Any] = SplashSettings) -> Any:
    """Return the settings of a ``kind`` that a property group or an operator holds."""
    return kind(**{item.name: plain(getattr(group, item.name)) for item in fields(kind)})


def plain(value: Any) -> Any:
    """Return a property's value without the noise of single precision (0.01, not 0.00999999978)."""
    return float(f"{value:.6g}") if isinstance(value, float) else value


def assign_settings(group: Any, settings: Settings) -> None:
    """Write ``settings`` into a property group or an operator."""
    for item in fields(settings):
        setattr(group, item.name, getattr(settings, item.name))


class SplashSettingsGroup(bpy.types.PropertyGroup):
    """The parameters of one splash."""

    __annotations__ = settings_properties()


def forget_frame(group: Any, _context: bpy.types.Context) -> None:
    """Let the next run fit a new frame: that of another sketch would not fit."""
    group.frame = ""


class SplashObjectGroup(bpy.types.PropertyGroup):
    """What a splash object knows of its making."""

    sketch: PointerProperty(
        type=bpy.types.Object,
        name="Sketch",
        description="Grease Pencil object whose strokes this splash is made of",
        poll=lambda _, candidate: candidate.type == "GREASEPENCIL",
        update=forget_frame,
    )
    layer: StringProperty(
        name="Layer",
        description="Layer of the sketch that this splash is made of; empty for all visible ones",
        update=forget_frame,
    )
    settings: PointerProperty(type=SplashSettingsGroup)
    made_of: StringProperty(description="What tells the strokes and settings from any others")
    is_covered: BoolProperty(description="Whether it is hidden because a model shows it")
    version: StringProperty(description="Version of the add-on that made this splash")
    # Text, because Blender's number properties are single precision and would turn the frame.
    frame: StringProperty(description="Local frame of the strokes: axes, centre and scale")
    frame_real_size: FloatProperty(description="Real size for which the frame was scaled")
    sketch_matrix: FloatVectorProperty(size=16, default=IDENTITY)
    splash_matrix: FloatVectorProperty(size=16, default=IDENTITY)
    weights_hash: StringProperty(description="SHA-256 of the weights that made this splash")
    precision: StringProperty(description="Number format in which the generator ran")
    device: StringProperty(description="Where the generator ran")
    summary: StringProperty(description="What the last run made")
    warnings: StringProperty(description="What the last run had to say, one line each")

    @property
    def is_splash(self) -> bool:
        """Whether the object was made by this add-on."""
        return bool(self.version)


class SplashSceneGroup(bpy.types.PropertyGroup):
    """The scene's choices for new splashes."""

    settings: PointerProperty(type=SplashSettingsGroup)


CLASSES = (SplashSettingsGroup, SplashObjectGroup, SplashSceneGroup)
register_classes, unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Add ``Object.splash`` and ``Scene.splash``."""
    register_classes()
    bpy.types.Object.splash = PointerProperty(type=SplashObjectGroup)
    bpy.types.Scene.splash = PointerProperty(type=SplashSceneGroup)


def unregister() -> None:
    """Remove ``Object.splash`` and ``Scene.splash``."""
    del bpy.types.Scene.splash
    del bpy.types.Object.splash
    unregister_classes()
