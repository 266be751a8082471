# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators on the list of refinements: add, remove, reorder, apply, presets."""

from __future__ import annotations

from functools import partial
from typing import Any

import bpy
from bpy.props import EnumProperty

from ...core.refinement.presets import PRESETS
from ...core.refinement.settings import KINDS
from ..data.model import is_model
from ..data.refinements import ITEMS, add_step
from ..jobs import flow_on, refine, scheduler, work_queue
from ..jobs.work_queue import Work
from ..scene import drop_points
from ..scene.objects import Handle, SceneError, check_writable
from ..scene.targets import shown_splash
from .queued_operator import QueuedOperator


class StackOperator:
    """What these operators share: they change the list of a splash, then evaluate it."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    needs_items = True

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash, and an entry in its list if the operator needs one."""
        splash = shown_splash(context)
        if splash is None:
            cls.poll_message_set("Select a splash, or its sketch")
        elif cls.needs_items and not splash.splash_stack.items:
            cls.poll_message_set("The splash has no refinements: add one first")
        else:
            return True
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Change the list and evaluate; report what cannot be refined and leave it as it is."""
        splash = shown_splash(context)
        try:
            check_writable(splash)
            with scheduler.held():  # a preset sets many values
                self.change(splash)
                scheduler.request(splash)
            if work_queue.is_immediate():  # it has been done: say why if it has not
                scheduler.raise_failure(splash)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def change(self, splash: bpy.types.Object) -> None:
        """Change the list of ``splash``."""
        raise NotImplementedError


class WaitingStackOperator(QueuedOperator, StackOperator):
    """What those share that wait for the refined liquid."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there are refinements, and no other run."""
        return super().poll(context) and cls.is_free()

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of the splash."""
        self._item = Handle.of(shown_splash(context))

    def item(self) -> bpy.types.Object:
        """Find it again. Raises SceneError if it was deleted meanwhile."""
        found = self._item.find()
        if found is None:
            raise SceneError("The splash was deleted meanwhile, so nothing was made")
        return found

    def owner(self) -> int:
        """Return the splash or model."""
        return self._item.uid


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
    """Replace the refinements of the splash by those of a preset"""

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
        """Remove it; the one above becomes active."""
        stack = splash.splash_stack
        number = min(stack.active, len(stack.items) - 1)
        stack.items.remove(number)
        stack.active = max(number - 1, 0)


class SPLASH_OT_refinement_move(StackOperator, bpy.types.Operator):
    """Move the active refinement in the list: refinements act from top to bottom"""

    bl_idname = "splash.refinement_move"
    bl_label = "Move Refinement"
    direction: EnumProperty(items=[("UP", "Up", "Act earlier"), ("DOWN", "Down", "Act later")])

    def change(self, splash: bpy.types.Object) -> None:
        """Swap it with its neighbour."""
        stack = splash.splash_stack
        to = stack.active + (-1 if self.direction == "UP" else 1)
        if 0 <= to < len(stack.items):
            stack.items.move(stack.active, to)
            stack.active = to


class SPLASH_OT_refinement_update(StackOperator, bpy.types.Operator):
    """Carve and refine the splash again, after you moved its obstacles"""

    bl_idname = "splash.refinement_update"
    bl_label = "Update"
    needs_items = False

    def change(self, splash: bpy.types.Object) -> None:
        """Leave the list as it is."""


class SPLASH_OT_flow_on(WaitingStackOperator, bpy.types.Operator):
    """Let the splash flow on for the time set beside this button. Refinements come on top"""

    bl_idname = "splash.flow_on"
    bl_label = "Flow On"
    needs_items = False

    def read(self) -> Work:
        """Read what flows on."""
        splash = self.item()
        work = flow_on.task_of(splash)
        return Work(
            ("flow on", *work.key),
            partial(flow_on.compute, work),
            partial(flow_on.write, splash, work),
        )


class SPLASH_OT_drop_points(WaitingStackOperator, bpy.types.Operator):
    """Add the free drops as a point cloud with radius and velocity; it follows its splash"""

    bl_idname = "splash.drop_points"
    bl_label = "Drops as Points"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash with refinements, or a model."""
        return is_model(context.active_object) or super().poll(context)

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of the model or splash."""
        active = context.active_object
        self._item = Handle.of(active if is_model(active) else shown_splash(context))

    def read(self) -> Work:
        """Read what its drops are made of: drops are not stored."""
        item = self.item()
        kind = scheduler.kind_of(item)
        assert kind is not None
        task = kind.task_of(item)

        def write(result: Any) -> None:
            drop_points.ensure(item)
            kind.write(item, task, result)

        return Work(("drops", task.key), partial(kind.compute, task), write)


class SPLASH_OT_refinement_apply(WaitingStackOperator, bpy.types.Operator):
    """Keep the refined mesh as it is and empty the list"""

    bl_description = (
        "Keep the refined mesh as it is and empty the list. It is still a splash: Regenerate makes "
        "it again, without the refinements"
    )
    bl_idname = "splash.refinement_apply"
    bl_label = "Apply Refinements"

    def read(self) -> Work:
        """Read what the refined liquid is made of."""
        splash = self.item()
        task = refine.task_of(splash)
        return Work(
            ("apply", task.key),
            partial(refine.compute_applied, task),
            partial(self.write, splash, task),
        )

    def write(self, splash: bpy.types.Object, task: refine.Task, made: Any) -> None:
        """Write it. What was flown on is a part of it."""
        refine.write_applied(splash, task, made)
        flow_on.reset(splash)


CLASSES = (
    SPLASH_OT_refinement_add,
    SPLASH_OT_refinement_preset,
    SPLASH_OT_refinement_remove,
    SPLASH_OT_refinement_move,
    SPLASH_OT_refinement_update,
    SPLASH_OT_flow_on,
    SPLASH_OT_drop_points,
    SPLASH_OT_refinement_apply,
)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
