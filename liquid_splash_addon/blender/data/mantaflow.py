# SPDX-License-Identifier: GPL-3.0-or-later
"""What a domain remembers of the splash that was exported to it, and a scene of its domains."""

from __future__ import annotations

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...core.mantaflow.settings import MantaflowSettings
from .properties import settings_properties


class SplashMantaflowSettingsGroup(bpy.types.PropertyGroup):
    """The settings of one export."""

    __annotations__ = settings_properties(MantaflowSettings, options=set())


class SplashDomainGroup(bpy.types.PropertyGroup):
    """A liquid domain that was made of a splash or a model."""

    source: PointerProperty(
        type=bpy.types.Object,
        name="Splash",
        description="Splash or model whose liquid the first frame of this domain is",
    )
    settings: PointerProperty(type=SplashMantaflowSettingsGroup)
    cache: StringProperty(description="Folder that the first frame was written to")
    frame: IntProperty(description="Frame that was written")
    state: StringProperty(
        description="Digest of the domain's settings when it was written: changing one of them has "
        "Blender delete the cache"
    )
    made_of: StringProperty(description="Digest of the splash and settings that were written")
    is_temporary: BoolProperty(description="Whether the cache is in a temporary folder")
    removed: FloatProperty(description="Share of the velocity that diverges in thick liquid")
    fall: FloatProperty(description="What gravity adds to the velocity in a frame, solver's units")
    summary: StringProperty(description="What was written")
    verified: StringProperty(description="How well the first solved frame goes on from the splash")
    warnings: StringProperty(description="Warnings of the export, one per line")


class SplashDomainEntry(bpy.types.PropertyGroup):
    """A domain of a scene."""

    domain: PointerProperty(type=bpy.types.Object)


class SplashMantaflowSceneGroup(bpy.types.PropertyGroup):
    """What a scene remembers: the settings of new domains, and the domains that it has."""

    settings: PointerProperty(type=SplashMantaflowSettingsGroup)
    domains: CollectionProperty(type=SplashDomainEntry)


CLASSES = (
    SplashMantaflowSettingsGroup,
    SplashDomainGroup,
    SplashDomainEntry,
    SplashMantaflowSceneGroup,
)
register_classes, unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Add ``Object.splash_domain`` and ``Scene.splash_mantaflow``."""
    register_classes()
    bpy.types.Object.splash_domain = PointerProperty(type=SplashDomainGroup)
    bpy.types.Scene.splash_mantaflow = PointerProperty(type=SplashMantaflowSceneGroup)


def unregister() -> None:
    """Remove them."""
    del bpy.types.Scene.splash_mantaflow
    del bpy.types.Object.splash_domain
    unregister_classes()
