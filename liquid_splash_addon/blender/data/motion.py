# SPDX-License-Identifier: GPL-3.0-or-later
"""What a splash or a model remembers of how fast it moves."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import PointerProperty

from ...core.settings import MotionSettings
from .properties import blender_property, settings_properties
from .revisions import motion_changed

FOLLOWED: dict[str, Any] = {"update": motion_changed, "options": set()}
"""Not to be animated: animation calls no ``update``, and velocities would not follow."""


class SplashMotionGroup(bpy.types.PropertyGroup):
    """The motion of a splash or a model. New ones are given the settings of their scene.

    Unset, the time scale is 1: so it was before it could be chosen.
    """

    __annotations__ = settings_properties(MotionSettings, **FOLLOWED) | {
        "time_scale": blender_property(
            MotionSettings.__dataclass_fields__["time_scale"], FOLLOWED | {"default": 1.0}
        )
    }


class SplashNewMotionGroup(bpy.types.PropertyGroup):
    """The motion of new splashes."""

    __annotations__ = settings_properties(MotionSettings)


CLASSES = (SplashMotionGroup, SplashNewMotionGroup)
register_classes, unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Add ``Object.splash_motion`` and ``Scene.splash_motion``."""
    register_classes()
    bpy.types.Object.splash_motion = PointerProperty(type=SplashMotionGroup)
    bpy.types.Scene.splash_motion = PointerProperty(type=SplashNewMotionGroup)


def unregister() -> None:
    """Remove them."""
    del bpy.types.Scene.splash_motion
    del bpy.types.Object.splash_motion
    unregister_classes()
