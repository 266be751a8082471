# SPDX-License-Identifier: GPL-3.0-or-later
"""What a splash or a model remembers of its obstacles."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import EnumProperty, FloatProperty, PointerProperty, StringProperty

from . import index
from .revisions import LIQUID, changed, tell


def kind_changed(group: Any, _context: bpy.types.Context) -> None:
    """Tell the splashes and models that an object is an obstacle of."""
    item = group.id_data
    for liquid in (*index.splashes(), *index.models()):
        collection = liquid.splash_obstacles.collection
        if collection is not None and item in [*collection.all_objects]:
            tell(LIQUID, liquid)


class SplashObstacleGroup(bpy.types.PropertyGroup):
    """What an object counts as where it is an obstacle."""

    kind: EnumProperty(
        name="Counts As",
        description="What this object is to the liquid",
        items=(
            ("AUTO", "Automatic", "Solid if its faces enclose it, else a thin sheet"),
            ("SOLID", "Solid", "Its holes are closed: no liquid inside"),
            ("SHEET", "Sheet", "A thin sheet: liquid on both sides, also inside"),
        ),
        update=kind_changed,
    )


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
        description="Width of the gap between liquid and obstacles, in voxels of the splash",
        default=0.25, min=0.0, max=8.0, soft_max=4.0, precision=2, step=5,
        update=changed,
    )  # fmt: skip
    verdicts: StringProperty(
        description="What each obstacle was taken for when it was last read: name, tab, verdict"
    )

    @property
    def listed(self) -> list[tuple[str, str]]:
        """The names of the obstacles, and what each was taken for or why it was left out."""
        lines = [line.split("\t") for line in self.verdicts.split("\n") if "\t" in line]
        return [(name, verdict) for name, verdict, *_ in lines]


CLASSES = (SplashObstacleGroup, SplashObstaclesGroup)
register_classes, unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Add ``Object.splash_obstacle`` and ``Object.splash_obstacles``."""
    register_classes()
    bpy.types.Object.splash_obstacle = PointerProperty(type=SplashObstacleGroup)
    bpy.types.Object.splash_obstacles = PointerProperty(type=SplashObstaclesGroup)


def unregister() -> None:
    """Remove them."""
    del bpy.types.Object.splash_obstacle
    del bpy.types.Object.splash_obstacles
    unregister_classes()
