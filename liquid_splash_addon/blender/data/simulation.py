# SPDX-License-Identifier: GPL-3.0-or-later
"""What a splash or a model remembers of its frames: how they are made, and where they are."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, IntProperty, PointerProperty, StringProperty

from ...core.playback.settings import BakeSettings, PlaybackSettings
from ...core.simulation.settings import SimulationSettings
from .properties import settings_properties


class SplashSimulationSettingsGroup(bpy.types.PropertyGroup):
    """How the liquid moves."""

    __annotations__ = settings_properties(SimulationSettings)


class SplashPlaybackGroup(bpy.types.PropertyGroup):
    """How its frames are shown."""

    __annotations__ = settings_properties(PlaybackSettings)


class SplashBakeGroup(bpy.types.PropertyGroup):
    """Which frames are baked, and of what."""

    __annotations__ = settings_properties(BakeSettings)


class SplashSimulationGroup(bpy.types.PropertyGroup):
    """The frames of one splash or model: simulated, or baked one by one."""

    settings: PointerProperty(type=SplashSimulationSettingsGroup)
    playback: PointerProperty(type=SplashPlaybackGroup)
    bake: PointerProperty(type=SplashBakeGroup)
    is_baked: BoolProperty(description="Whether the frames were baked: a splash each")
    start: IntProperty(
        name="Start Frame",
        description="Frame of the scene at which the splash begins to move",
        default=1,
        min=0,
        max=1_000_000,
    )
    ground_object: PointerProperty(
        type=bpy.types.Object,
        name="Ground Object",
        description="Object, such as an Empty, whose height is that of the floor or of the pool's "
        "surface, in place of Height",
    )
    folder: StringProperty(description="Folder of the frames; // is the folder of the file")
    frames: IntProperty(description="Frames that can be played, the first included")
    wanted: IntProperty(description="Frames that were to be made, the first included")
    made_of: StringProperty(description="Digest of what the frames were made of")
    motion: PointerProperty(type=bpy.types.Object, description="The object that plays the frames")
    drops: PointerProperty(type=bpy.types.Object, description="The object that plays their drops")
    summary: StringProperty(description="What the last run made")
    warnings: StringProperty(description="Warnings of the last run, one per line")


CLASSES = (
    SplashSimulationSettingsGroup,
    SplashPlaybackGroup,
    SplashBakeGroup,
    SplashSimulationGroup,
)
register_classes, unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Add ``Object.splash_simulation``."""
    register_classes()
    bpy.types.Object.splash_simulation = PointerProperty(type=SplashSimulationGroup)


def unregister() -> None:
    """Remove ``Object.splash_simulation``."""
    del bpy.types.Object.splash_simulation
    unregister_classes()
