# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons of the refinement list: add, remove, reorder, apply, presets."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty

from ...core.refinement.presets import PRESETS
from ...core.refinement.settings import KINDS
from ..data.refinements import ITEMS, add_step
from ..jobs import refine, scheduler
from ..scene import drop_points
from ..scene.objects import check_writable
from ..scene.targets import shown_splash


def is_model(item: bpy.types.Object | None) -> bool:
    """Whether an object is a model."""
    return item is not None and item.splash_model.is_model


class StackOperator:
    """What the buttons share: a splash, changed, then evaluated anew."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    needs_items = True

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash, and something in its list where that is needed."""
        splash = shown_splash(context)
        if splash is None:
            cls.poll_message_set("Select a splash, or its sketch")
        elif cls.needs_items and not splash.splash_stack.items:
            cls.poll_message_set("The splash has no refinements: add one first")
        else:
            return True
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Change the list; what cannot be refined is left as it is, and said."""
        splash = shown_splash(context)
        try:
            check_writable(splash)
            self.change(splash)
            if bpy.app.background:
                refine.evaluate(splash)
            else:
                scheduler.request(splash)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def change(self, splash: bpy.types.Object) -> None:
        """Change the list of ``splash``."""
        raise NotImplementedError


class SPLASH_OT_refinement_add(StackOperator, bpy.types.Operator):
    """Add a refinement to the splash"""

    bl_idname = "splash.refinement_add"
    bl_label = "Add Refinement"
    needs_items = False
    kind: EnumProperty(items=ITEMS, name="Kind")

    def change(self, splash: bpy.types.Object) -> None:
        """Append it."""
        add_step(splash, KINDS[self.kind]())


class SPLASH_OT_refinement_preset(StackOperator, bpy.types.Operator):
    """Replace the refinements of the splash by a preset's"""

    bl_idname = "splash.refinement_preset"
    bl_label = "Refinement Preset"
    needs_items = False
    preset: EnumProperty(
        items=[(name, preset.label, preset.about) for name, preset in PRESETS.items()],
        name="Preset",
    )

    def change(self, splash: bpy.types.Object) -> None:
        """Replace the list."""
        splash.splash_stack.items.clear()
        for settings in PRESETS[self.preset].steps:
            add_step(splash, settings)


class SPLASH_OT_refinement_remove(StackOperator, bpy.types.Operator):
    """Remove the active refinement"""

    bl_idname = "splash.refinement_remove"
    bl_label = "Remove Refinement"

    def change(self, splash: bpy.types.Object) -> None:
        """Remove it; the one before it becomes the active one."""
        stack = splash.splash_stack
        number = min(stack.active, len(stack.items) - 1)
        stack.items.remove(number)
        stack.active = max(number - 1, 0)


class SPLASH_OT_refinement_move(StackOperator, bpy.types.Operator):
    """Move the active refinement: those above act first"""

    bl_idname = "splash.refinement_move"
    bl_label = "Move Refinement"
    direction: EnumProperty(items=[("UP", "Up", "To act earlier"), ("DOWN", "Down", "Later")])

    def change(self, splash: bpy.types.Object) -> None:
        """Swap it with its neighbour."""
        stack = splash.splash_stack
        to = stack.active + (-1 if self.direction == "UP" else 1)
        if 0 <= to < len(stack.items):
            stack.items.move(stack.active, to)
            stack.active = to


class SPLASH_OT_refinement_update(StackOperator, bpy.types.Operator):
    """Carve and refine the splash anew, after its obstacles were moved"""

    bl_idname = "splash.refinement_update"
    bl_label = "Update"
    needs_items = False

    def change(self, splash: bpy.types.Object) -> None:
        """Nothing in the list changes."""


class SPLASH_OT_drop_points(bpy.types.Operator):
    """Add the free drops as a point cloud with radius and velocity; it follows its splash"""

    bl_idname = "splash.drop_points"
    bl_label = "Drops as Points"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    needs_items = True

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there are refinements, of the splash or those of a model."""
        if is_model(context.active_object):
            return True
        return bool(StackOperator.poll.__func__(cls, context))  # type: ignore[attr-defined]

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Add the object, and evaluate: the drops themselves are not stored."""
        item = context.active_object if is_model(context.active_object) else shown_splash(context)
        try:
            check_writable(item)
            drop_points.ensure(item)
            scheduler.evaluate(item)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class SPLASH_OT_refinement_apply(bpy.types.Operator):
    """Keep the refined mesh as it is and empty the list"""

    bl_description = (
        "Keep the refined mesh as it is and empty the list. The splash stays one: Regenerate "
        "makes it anew, without the refinements"
    )
    bl_idname = "splash.refinement_apply"
    bl_label = "Apply Refinements"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a list."""
        return bool(StackOperator.poll.__func__(cls, context))  # type: ignore[attr-defined]

    needs_items = True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Evaluate what waits, then empty the list without evaluating it."""
        splash = shown_splash(context)
        try:
            refine.evaluate(splash)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        splash.splash_stack.items.clear()
        splash.splash_stack.evaluated = ""
        return {"FINISHED"}


CLASSES = (
    SPLASH_OT_refinement_add,
    SPLASH_OT_refinement_preset,
    SPLASH_OT_refinement_remove,
    SPLASH_OT_refinement_move,
    SPLASH_OT_refinement_update,
    SPLASH_OT_drop_points,
    SPLASH_OT_refinement_apply,
)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
