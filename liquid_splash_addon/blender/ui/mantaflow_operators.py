# SPDX-License-Identifier: GPL-3.0-or-later
"""Export to Mantaflow, bake, and verify."""

from __future__ import annotations

from functools import partial
from typing import Any
from uuid import uuid4

import bpy

from ..jobs import bake_mantaflow, export_mantaflow
from ..jobs.work_queue import Work
from ..scene import fluid_domain
from ..scene.objects import Handle, SceneError
from ..scene.targets import shown_liquid
from .queued_operator import QueuedOperator


def exported_item(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the splash or model that is meant: of the active domain, the model, the splash."""
    return fluid_domain.source_of(context.active_object) or shown_liquid(context)


def shown_domain(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the domain that is meant: the active one, else that of the splash or model."""
    active = context.active_object
    if fluid_domain.settings_of(active) is not None and active.splash_domain.source is not None:
        return active
    item = exported_item(context)
    return None if item is None else fluid_domain.domain_of(item, context.scene)


class SPLASH_OT_mantaflow_export(QueuedOperator, bpy.types.Operator):
    """Make a liquid domain whose first frame is the splash"""

    bl_description = (
        "Make a liquid domain of Blender's own solver around the splash or model, whose first "
        "frame has its liquid and its velocity everywhere. Used again, it updates the same domain"
    )
    bl_idname = "splash.mantaflow_export"
    bl_label = "Export to Mantaflow"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash or a model, and no other run."""
        if not cls.is_free():
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Switch to Object Mode first")
        elif exported_item(context) is None:
            cls.poll_message_set("Select a splash or a model, or the sketch of a splash")
        else:
            return True
        return False

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of the splash or model."""
        item = exported_item(context)
        if item is None:
            raise SceneError("Select a splash or a model first")
        self._item, self._folder = Handle.of(item), uuid4().hex[:8]

    def owner(self) -> int:
        """Return the splash or model."""
        return self._item.uid

    def read(self) -> Work:
        """Take a snapshot of the scene."""
        item = self._item.find()
        if item is None:
            raise SceneError("The splash was deleted meanwhile, so nothing was exported")
        task = export_mantaflow.read_task(bpy.context, item, self._folder)
        return Work(
            task.key, partial(export_mantaflow.compute, task), partial(self.write_result, task)
        )

    def write_result(self, task: Any, made: Any) -> None:
        """Set the domain and report what was written."""
        domain = export_mantaflow.write(bpy.context, task, made, self._item.find())
        self.report({"INFO"}, f"{domain.name}: {domain.splash_domain.summary}")
        for warning in filter(None, domain.splash_domain.warnings.split("\n")):
            self.report({"WARNING"}, warning)


class DomainOperator:
    """What the operators on an exported domain share."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a domain."""
        if shown_domain(context) is None:
            cls.poll_message_set("Export the splash to Mantaflow first")  # type: ignore[attr-defined]
        elif context.mode != "OBJECT":
            cls.poll_message_set("Switch to Object Mode first")  # type: ignore[attr-defined]
        else:
            return True
        return False


class SPLASH_OT_mantaflow_bake(DomainOperator, bpy.types.Operator):
    """Simulate the splash from its first frame on; Esc stops, and Resume goes on"""

    bl_idname = "splash.mantaflow_bake"
    bl_label = "Bake"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Bake, or start Blender's job for it."""
        domain = shown_domain(context)
        try:
            bake_mantaflow.bake(context, domain)
        except (ValueError, RuntimeError) as error:
            self.report({"ERROR"}, str(error).strip())
            return {"CANCELLED"}
        if domain.splash_domain.verified:
            self.report({"INFO"}, domain.splash_domain.verified)
        return {"FINISHED"}


class SPLASH_OT_mantaflow_verify(DomainOperator, bpy.types.Operator):
    """Compare the first frame that was solved with the splash: velocity, momentum, volume"""

    bl_idname = "splash.mantaflow_verify"
    bl_label = "Verify"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Compare and report."""
        domain = shown_domain(context)
        domain.splash_domain.verified = bake_mantaflow.verify(domain, context.scene)
        self.report({"INFO"}, domain.splash_domain.verified)
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory(
    (SPLASH_OT_mantaflow_export, SPLASH_OT_mantaflow_bake, SPLASH_OT_mantaflow_verify)
)
