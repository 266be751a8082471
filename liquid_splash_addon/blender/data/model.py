# SPDX-License-Identifier: GPL-3.0-or-later
"""What a model remembers: the splashes it is made of, and how they are joined."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...core.refinement.settings import SheetSettings, WaveSettings
from ...core.settings import ModelSettings
from . import index
from .properties import is_splash, settings_properties
from .revisions import changed


class SplashModelSettingsGroup(bpy.types.PropertyGroup):
    """How the splashes of a model are joined."""

    __annotations__ = settings_properties(ModelSettings, update=changed)


class SplashModelSheetsGroup(bpy.types.PropertyGroup):
    """Settings of the sheets on the joined surface."""

    __annotations__ = settings_properties(SheetSettings, update=changed)


class SplashModelWavesGroup(bpy.types.PropertyGroup):
    """Settings of the waves on the joined surface."""

    __annotations__ = settings_properties(WaveSettings, update=changed)


class SplashPartGroup(bpy.types.PropertyGroup):
    """A splash in a model; it keeps the splash's name, to report a splash that was deleted."""

    splash: PointerProperty(type=bpy.types.Object, name="Splash", update=changed)
    show: BoolProperty(
        default=True, name="Show", description="Whether the splash is in the model", update=changed
    )

    @property
    def is_there(self) -> bool:
        """Whether the splash still exists: a deleted one is in no scene."""
        return is_splash(self.splash) and index.is_in_scene(self.splash)


class SplashModelGroup(bpy.types.PropertyGroup):
    """What a model object is made of."""

    is_model: BoolProperty(
        description="Whether the object is a model of several splashes", update=index.forget
    )
    parts: CollectionProperty(type=SplashPartGroup)
    active: IntProperty(name="Active", description="The splash whose settings are shown")
    settings: PointerProperty(type=SplashModelSettingsGroup)
    use_sheets: BoolProperty(
        name="Sheets",
        description="Films and rims on the joined surface. The sheets of its splashes are ignored",
        update=changed,
    )
    sheets: PointerProperty(type=SplashModelSheetsGroup)
    use_waves: BoolProperty(
        name="Waves",
        description="Capillary waves on the joined surface. The waves of its splashes are ignored",
        update=changed,
    )
    waves: PointerProperty(type=SplashModelWavesGroup)
    pending: BoolProperty(
        description="Whether the mesh is yet to follow a change: copies and saved files go on"
    )
    evaluated: StringProperty(description="Digest of what the mesh was last made of")
    summary: StringProperty(description="What the last evaluation made")
    warnings: StringProperty(description="Warnings of the last evaluation, one per line")


def is_model(item: bpy.types.Object | None) -> bool:
    """Whether there is an object, and it is a model."""
    return index.carries(item, index.MODEL)


def active_part(item: bpy.types.Object | None) -> bpy.types.Object | None:
    """Return the splash that is selected in a model's list; None if ``item`` is no model."""
    if not is_model(item):
        return None
    group = item.splash_model
    if not 0 <= group.active < len(group.parts):
        return None
    part = group.parts[group.active]
    return part.splash if part.is_there else None


def splashes_in(model: bpy.types.Object) -> list[bpy.types.Object]:
    """List the splashes of ``model`` that still exist."""
    return [part.splash for part in model.splash_model.parts if part.is_there]


def models_of(splash: bpy.types.Object) -> list[bpy.types.Object]:
    """List the models that hold ``splash``: one, or a copy of it too until it has its own parts."""
    return [model for model in index.models() if splash in splashes_in(model)]


CLASSES = (
    SplashModelSettingsGroup,
    SplashModelSheetsGroup,
    SplashModelWavesGroup,
    SplashPartGroup,
    SplashModelGroup,
)
register_classes, unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Add ``Object.splash_model``."""
    register_classes()
    bpy.types.Object.splash_model = PointerProperty(type=SplashModelGroup)


def unregister() -> None:
    """Remove ``Object.splash_model``."""
    del bpy.types.Object.splash_model
    unregister_classes()
