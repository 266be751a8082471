# SPDX-License-Identifier: GPL-3.0-or-later
"""All panels and buttons of the add-on, drawn without a window, and a crowd of other objects."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import bpy

from liquid_splash_addon.blender.ui import (
    bake_operators,
    bake_panel,
    mantaflow_operators,
    mantaflow_panel,
    model_operators,
    model_panel,
    motion_operators,
    motion_panel,
    operators,
    panels,
    preferences_operators,
    refinement_operators,
    refinement_panel,
    simulate_operators,
    simulate_panel,
)

FOREIGN_GROUPS = (
    "splash",
    "splash_stack",
    "splash_model",
    "splash_obstacles",
    "splash_motion",
    "splash_simulation",
    "splash_domain",
)
"""What only splashes, models, and drops should be given."""


class Recorder:
    """Stands in for a layout and keeps the texts, operators and properties it was given."""

    def __init__(self, said: list[str]) -> None:
        self.__dict__["said"] = said

    def __setattr__(self, name: str, value: Any) -> None:
        """Take any setting of a layout."""

    def __getattr__(self, name: str) -> Any:
        def call(*args: Any, **options: Any) -> Recorder:
            self.said.extend(str(value) for value in (*args, options.get("text", "")) if value)
            return Recorder(self.said)

        return call


def drawn(panel: Any) -> str:
    """Return all that ``panel`` shows now, in one line."""
    said: list[str] = []
    panel.draw(SimpleNamespace(layout=Recorder(said)), bpy.context)
    return " ".join(said)


def classes(base: type) -> list[Any]:
    """Return the add-on's classes of a kind, panels or operators."""
    rooms = (bake_operators, bake_panel, mantaflow_operators, mantaflow_panel, model_operators,
             model_panel, motion_operators, motion_panel, operators, panels, preferences_operators,
             refinement_operators, refinement_panel, simulate_operators,
             simulate_panel)  # fmt: skip
    found = {
        value
        for room in rooms
        for value in vars(room).values()
        if isinstance(value, type) and issubclass(value, base) and value is not base
    }
    return sorted(found, key=lambda value: value.__name__)


def draw_all() -> None:
    """Ask every panel and every button whether it is shown, and draw those that are."""
    for panel in classes(bpy.types.Panel):
        if not hasattr(panel, "poll") or panel.poll(bpy.context):
            drawn(panel)
    for menu in classes(bpy.types.Menu):
        drawn(menu)
    for operator in classes(bpy.types.Operator):
        if hasattr(operator, "poll"):
            operator.poll(bpy.context)


def add_objects(count: int) -> list[str]:
    """Add triangles that have nothing to do with splashes, and return their names."""
    mesh = bpy.data.meshes.new("Other")
    mesh.from_pydata([(0, 0, 9), (1, 0, 9), (0, 1, 9)], [], [(0, 1, 2)])
    others = [bpy.data.objects.new("Other", mesh) for _ in range(count)]
    for item in others:
        bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    return [item.name for item in others]
