# SPDX-License-Identifier: GPL-3.0-or-later
"""What a splash and a scene remember; their settings are made from core's list of parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import Field, fields
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...core.settings import Settings, SplashSettings
from . import index
from .revisions import changed
from .start import start_property

STROKE_TYPES = ("GREASEPENCIL", "CURVE", "CURVES")
"""Types of the objects whose strokes a splash can be made of."""

IDENTITY = tuple(float(row == column) for column in range(4) for row in range(4))


def settings_properties(kind: type[Settings] = SplashSettings, **extra: Any) -> dict[str, Any]:
    """Make a Blender property for every field of a ``kind`` of settings, by name.

    extra : passed on to each property, such as ``options={"SKIP_SAVE"}``.
    """
    return {item.name: blender_property(item, extra) for item in fields(kind)}


def blender_property(item: Field[Any], extra: dict[str, Any]) -> Any:
    """Make the Blender property for one field of some settings."""
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
    """Read the settings of a ``kind`` from a property group or an operator."""
    return kind(**{item.name: plain(getattr(group, item.name)) for item in fields(kind)})


def plain(value: Any) -> Any:
    """Remove the noise of single precision from a property's value (0.01, not 0.00999999978)."""
    return float(f"{value:.6g}") if isinstance(value, float) else value


def assign_settings(group: Any, settings: Settings) -> None:
    """Write ``settings`` into a property group or an operator."""
    for item in fields(settings):
        setattr(group, item.name, getattr(settings, item.name))


def liquid_changed(group: Any, context: bpy.types.Context) -> None:
    """Tell that a splash, not a scene, is of another liquid: its refinements follow."""
    if isinstance(group.id_data, bpy.types.Object):
        changed(group, context)


class SplashSettingsGroup(bpy.types.PropertyGroup):
    """The parameters of one splash."""

    __annotations__ = settings_properties() | {
        "liquid": blender_property(
            SplashSettings.__dataclass_fields__["liquid"], {"update": liquid_changed}
        )
    }


def fit_anew(group: Any, _context: bpy.types.Context) -> None:
    """Have the next run fit a frame to the new strokes; until then the liquid keeps its own."""
    group.id_data.splash.refit = True


def has_strokes(_group: Any, candidate: bpy.types.Object) -> bool:
    """Whether a splash can be made of an object."""
    return candidate.type in STROKE_TYPES


class SplashSourceGroup(bpy.types.PropertyGroup):
    """A further object whose strokes belong to the sketch of a splash."""

    sketch: PointerProperty(
        type=bpy.types.Object,
        name="And",
        description="Object whose strokes belong to the sketch too. Empty: none",
        poll=has_strokes,
        update=fit_anew,
    )


class SplashObjectGroup(bpy.types.PropertyGroup):
    """How a splash object was made."""

    sketch: PointerProperty(
        type=bpy.types.Object,
        name="Sketch",
        description="Grease Pencil or curve object whose strokes this splash is made of",
        poll=has_strokes,
        update=fit_anew,
    )
    others: CollectionProperty(type=SplashSourceGroup)
    layer: StringProperty(
        name="Layer",
        description="Layer of the sketch that this splash is made of. Empty: all visible layers",
        update=fit_anew,
    )
    settings: PointerProperty(type=SplashSettingsGroup)
    made_with: StringProperty(description="The settings that it was made with")
    made_threshold: FloatProperty(description="That of them which is the surface's; 0: not noted")
    regime: StringProperty(description="What is computed where no generator knows its size")
    fastest: FloatProperty(description="Fastest speed, m/s, that its generator knows; 0: not noted")
    made_of: StringProperty(description="Digest of the strokes and settings that it was made of")
    is_covered: BoolProperty(description="Whether the splash is hidden because a model shows it")
    version: StringProperty(
        description="Version of the add-on that made this splash", update=index.forget
    )
    # As text: in single precision, as Blender's number properties are, it would turn a little.
    frame: StringProperty(description="Local frame of the strokes: axes, centre and scale")
    refit: BoolProperty(description="Whether the next run fits a new frame: to other strokes")
    frame_real_size: FloatProperty(description="Real size for which the frame was scaled")
    sketch_matrix: FloatVectorProperty(size=16, default=IDENTITY)
    splash_matrix: FloatVectorProperty(size=16, default=IDENTITY)
    sketch_world: FloatVectorProperty(size=16, default=IDENTITY)
    weights_hash: StringProperty(description="SHA-256 of the network that made this splash")
    precision: StringProperty(description="Number format in which the generator ran")
    device: StringProperty(description="Where the generator ran")
    summary: StringProperty(description="What the last run made")
    warnings: StringProperty(description="Warnings of the last run, one per line")

    owner: PointerProperty(
        type=bpy.types.Object,
        description="The one object that this one belongs to: the splash of its drops, the model "
        "of its parts. Copies refer to it too, but it does not refer to them",
    )

    @property
    def is_splash(self) -> bool:
        """Whether the object was made by this add-on, see :func:`is_splash`."""
        return bool(self.version)


def is_splash(item: bpy.types.Object | None) -> bool:
    """Whether there is an object, and it is a splash of this add-on."""
    return index.carries(item, index.SPLASH)


def owner_of(item: bpy.types.Object) -> bpy.types.Object | None:
    """Return the splash or model that an object belongs to, without giving it our properties."""
    return item.splash.owner if item.is_property_set("splash") else None


class SplashSceneGroup(bpy.types.PropertyGroup):
    """What a scene remembers: the settings for new splashes, and how they are made."""

    settings: PointerProperty(type=SplashSettingsGroup)
    chosen_start: StringProperty(
        description="What new splashes start with; empty: what the preferences say"
    )
    start: start_property()
    live: BoolProperty(
        name="Live",
        description="While strokes or settings are changed, a preview of the active sketch's "
        "splash follows, and the full resolution once nothing changes any more. Esc stops what is "
        "being made",
    )
    follow: BoolProperty(
        name="Follow Sketch",
        description="New splashes are children of their sketch: they move, turn and scale with it",
        default=True,
    )


CLASSES = (SplashSettingsGroup, SplashSourceGroup, SplashObjectGroup, SplashSceneGroup)
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
