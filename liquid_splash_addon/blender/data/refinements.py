# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of refinements that each splash remembers, of the kinds that core knows."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...core.refinement.settings import KINDS, RefinementSettings
from ...core.simulation.settings import FlowOnSettings
from .properties import assign_settings, settings_properties, to_settings
from .revisions import changed

STORED = ("DROPLETS", "RUPTURES", "WAVES", "CLEANUP", "SHEETS")
"""Kinds by the numbers that files keep of them: new ones come last."""

ITEMS = [
    (kind, settings.label, settings.about, STORED.index(kind)) for kind, settings in KINDS.items()
]


def make_group(kind: str, settings: type[RefinementSettings]) -> type[bpy.types.PropertyGroup]:
    """Make the property group for the settings of one kind."""
    return type(
        f"Splash{kind.title()}Group",
        (bpy.types.PropertyGroup,),
        {
            "__doc__": f"Settings of {settings.label}.",
            "__annotations__": settings_properties(settings, update=changed),
        },
    )


GROUPS = {kind: make_group(kind, settings) for kind, settings in KINDS.items()}


class SplashRefinementGroup(bpy.types.PropertyGroup):
    """One refinement of a splash: its kind, and the settings of every kind."""

    __annotations__ = {
        "kind": EnumProperty(items=ITEMS, name="Kind", description="What the refinement does"),
        "show": BoolProperty(
            default=True,
            name="Show",
            description="Whether the refinement is used",
            update=changed,
        ),
        **{kind.lower(): PointerProperty(type=group) for kind, group in GROUPS.items()},
    }

    @property
    def group(self) -> Any:
        """The settings of its own kind, as Blender's property group."""
        return getattr(self, self.kind.lower())

    @property
    def settings(self) -> RefinementSettings:
        """The settings of its own kind, as core's dataclass."""
        settings: RefinementSettings = to_settings(self.group, KINDS[self.kind])
        return settings


class SplashFlowOnGroup(bpy.types.PropertyGroup):
    """The time that a splash flows on before it is refined."""

    __annotations__ = settings_properties(FlowOnSettings)


class SplashStackGroup(bpy.types.PropertyGroup):
    """The refinements of a splash, first to last."""

    flow_on: PointerProperty(type=SplashFlowOnGroup)
    flowed: StringProperty(
        description="Digest of what the stored liquid was flown on with; empty if it was not"
    )
    items: CollectionProperty(type=SplashRefinementGroup)
    active: IntProperty(name="Active", description="The refinement whose settings are shown")
    pending: BoolProperty(
        description="Whether the mesh is yet to follow a change: copies and saved files go on"
    )
    evaluated: StringProperty(description="Digest of what the mesh was last refined with")
    points: PointerProperty(
        type=bpy.types.Object,
        name="Drops",
        description="Object that holds the free drops",
    )
    summary: StringProperty(description="How the refinements changed the volume")
    warnings: StringProperty(description="Warnings of the refinements, one per line")


def steps_of(splash: bpy.types.Object) -> list[RefinementSettings]:
    """List the settings of the refinements of ``splash`` that are switched on, for core."""
    return [item.settings for item in splash.splash_stack.items if item.show]


def add_step(splash: bpy.types.Object, settings: RefinementSettings) -> Any:
    """Append a refinement with ``settings`` to the list of ``splash`` and return its entry."""
    stack = splash.splash_stack
    item = stack.items.add()
    item.kind = next(kind for kind, known in KINDS.items() if type(settings) is known)
    item.name = unused_name(splash, settings.label)
    assign_settings(item.group, settings)
    stack.active = len(stack.items) - 1
    return item


def unused_name(splash: bpy.types.Object, name: str) -> str:
    """Append a number to ``name`` if another refinement of the splash has it already."""
    used = {item.name for item in splash.splash_stack.items}
    number, found = 1, name
    while found in used:
        found, number = f"{name}.{number:03d}", number + 1
    return found


CLASSES = (*GROUPS.values(), SplashFlowOnGroup, SplashRefinementGroup, SplashStackGroup)
register_classes, unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Add ``Object.splash_stack``."""
    register_classes()
    bpy.types.Object.splash_stack = PointerProperty(type=SplashStackGroup)


def unregister() -> None:
    """Remove ``Object.splash_stack``."""
    del bpy.types.Object.splash_stack
    unregister_classes()
