# SPDX-License-Identifier: GPL-3.0-or-later
"""What a splash or a model remembers of its obstacles."""

from __future__ import annotations

import bpy
from bpy.props import FloatProperty, PointerProperty

from .revisions import changed


class SplashObstaclesGroup(bpy.types.PropertyGroup):
    """The obstacles of a splash or a model."""

    collection: PointerProperty(
        type=bpy.types.Collection,
        name="Obstacles",
        description="The liquid flows around the objects in this collection, and is carved away "
        "where it would be inside them",
        update=changed,
    )
    clearance: FloatProperty(
        name="Clearance",
        description="Width of the gap between liquid and obstacles, in cells of the splash",
        default=0.25, min=0.0, max=8.0, soft_max=4.0, precision=2, step=5,
        update=changed,
    )  # fmt: skip


register_classes, unregister_classes = bpy.utils.register_classes_factory((SplashObstaclesGroup,))


def register() -> None:
    """Add ``Object.splash_obstacles``."""
    register_classes()
    bpy.types.Object.splash_obstacles = PointerProperty(type=SplashObstaclesGroup)


def unregister() -> None:
    """Remove ``Object.splash_obstacles``."""
    del bpy.types.Object.splash_obstacles
    unregister_classes()
