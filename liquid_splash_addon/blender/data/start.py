# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of refinements that new splashes start with: a scene's choice, else the preferences'."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
from bpy.props import EnumProperty

from ...core.refinement.presets import STARTS
from .preferences import START_ITEMS, own_preferences

if TYPE_CHECKING:
    from ...core.refinement.settings import RefinementSettings

ABOUT = {
    "name": "Start With",
    "description": "The refinements that a new splash begins with. Splashes that exist keep theirs",
    "items": START_ITEMS,
}


def usual_start() -> str:
    """Return what the preferences say, where a scene has made no choice."""
    preferences = own_preferences(bpy.context)
    return str(preferences.start) if preferences else next(iter(STARTS))


def get_start(scene_group: Any) -> int:
    """Return the number of what new splashes of a scene start with."""
    chosen = scene_group.chosen_start
    return list(STARTS).index(chosen if chosen in STARTS else usual_start())


def set_start(scene_group: Any, number: int) -> None:
    """Have a scene no longer follow the preferences."""
    scene_group.chosen_start = list(STARTS)[number]


def start_property() -> Any:
    """Return the property of a scene; its choice is kept in ``chosen_start``, empty for none."""
    return EnumProperty(get=get_start, set=set_start, **ABOUT)


def starting_steps(context: bpy.types.Context, start: str = "") -> tuple[RefinementSettings, ...]:
    """Return the refinements for a new splash: of ``start``, by default of the scene's choice."""
    return STARTS[start or context.scene.splash.start].steps
