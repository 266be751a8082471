# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators of models: generate layers, combine, add, remove, update."""

from __future__ import annotations

from functools import partial
from typing import Any

import bpy
from bpy.props import StringProperty

from ..data import index
from ..data.model import is_model, models_of
from ..data.properties import STROKE_TYPES, is_splash
from ..jobs import generate_layers, scheduler
from ..jobs.work_queue import Work
from ..scene import model_parts, targets
from ..scene.objects import SceneError, select_only
from .operators import SplashMaker


class SPLASH_OT_generate_layers(SplashMaker, bpy.types.Operator):
    """Make a splash from each visible layer of the sketch and join them into one model"""

    bl_description = (
        "Make a splash from each visible layer of the active sketch, and join them into one model. "
        "Each has its own settings and refinements. Used again, it updates only the layers that "
        "have changed"
    )
    bl_idname = "splash.generate_layers"
    bl_label = "Generate Layers"
    bl_options = {"UNDO"}  # noqa: RUF012 (no redo panel: each layer has settings of its own)
    needs_splash = False

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a sketch that can have layers, and no other run."""
        if not super().poll(context):
            return False
        if targets.find_target(context).sketch.type == "GREASEPENCIL":
            return True
        cls.poll_message_set("Curves have no layers: select a Grease Pencil sketch")
        return False

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of the sketch alone: each layer has its own splash."""
        super().begin(context)
        self._splash = None

    def read(self) -> Work:
        """Take a snapshot of the scene."""
        request = generate_layers.snapshot(bpy.context, self.found().sketch, self.chosen_settings)
        return Work(
            request.key,
            partial(generate_layers.compute, request),
            partial(self.write_result, request),
        )

    def write_result(self, request: Any, result: Any) -> None:
        """Write the splashes and report what was made."""
        warnings = generate_layers.write(bpy.context, request, result)
        made = len(request.runs)
        self.report({"INFO"}, f"{made} layer(s) made, {request.kept} unchanged")
        for warning in warnings:
            self.report({"WARNING"}, warning)


def chosen_splashes(context: bpy.types.Context) -> list[bpy.types.Object]:
    """List the selected splashes; if there are none, those of the active sketch."""
    known = set(index.splashes())
    selected = [item for item in context.selected_objects if item in known]
    active = context.active_object
    if selected or active is None or active.type not in STROKE_TYPES:
        return selected
    return targets.splashes_of(active, context.scene)


def chosen_model(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the model to add splashes to: a selected one, or one that holds a chosen splash."""
    for item in context.selected_objects:
        if is_model(item):
            return item
    found = [model for splash in chosen_splashes(context) for model in models_of(splash)]
    return found[0] if found else None


class SPLASH_OT_combine(bpy.types.Operator):
    """Join the selected splashes, or those of the active sketch, into one model"""

    bl_description = (
        "Join the selected splashes, or those of the active sketch, smoothly into one model with "
        "symmetry and waves of its own. The splashes are kept, hidden, and can still be changed. "
        "If a model is selected too, they are added to it"
    )
    bl_idname = "splash.combine"
    bl_label = "Combine"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is something to combine."""
        if context.mode not in ("OBJECT", "PAINT_GREASE_PENCIL", "EDIT_GREASE_PENCIL"):
            cls.poll_message_set("Switch to Object Mode first")
        elif not chosen_splashes(context):
            cls.poll_message_set("Select splashes, or a sketch that has splashes")
        else:
            return True
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Make or extend the model; on an error everything stays as it was."""
        splashes, model = chosen_splashes(context), chosen_model(context)
        try:
            if model is not None:
                with scheduler.held():
                    model_parts.add_parts(model, splashes)
                    scheduler.request(model)
            else:
                model = combined(context, splashes)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if context.mode == "OBJECT":
            select_only(context, model)
        if model.splash_model.warnings:
            self.report({"WARNING"}, model.splash_model.warnings)
        return {"FINISHED"}


def combined(context: bpy.types.Context, splashes: list[bpy.types.Object]) -> bpy.types.Object:
    """Make a model. Raises ValueError, and leaves nothing behind, if it cannot be made."""
    with scheduler.held():
        model = model_parts.new_model(context, splashes)
    # With a window the mesh is made later, and its panel shows what went wrong.
    if bpy.app.background and not model.splash_model.evaluated:
        reason = model.splash_model.warnings
        model_parts.dissolve(model)
        raise SceneError(reason)
    return model


class ModelOperator:
    """What the operators on a model's list share."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether a model is active."""
        if is_model(context.active_object):
            return True
        cls.poll_message_set("Select a model first")  # type: ignore[attr-defined]
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Change the list, then have the model evaluated."""
        model = context.active_object
        try:
            with scheduler.held():
                self.change(context, model)
                scheduler.request(model)
        except ValueError as error:
            self.report({"ERROR"}, str(error))  # type: ignore[attr-defined]
            return {"CANCELLED"}
        return {"FINISHED"}

    def change(self, context: bpy.types.Context, model: bpy.types.Object) -> None:
        """Change the list of ``model``."""
        raise NotImplementedError


class SPLASH_OT_part_add(ModelOperator, bpy.types.Operator):
    """Add a splash to the model"""

    bl_idname = "splash.part_add"
    bl_label = "Add Splash"
    splash: StringProperty(name="Splash", description="Name of the splash")

    def change(self, context: bpy.types.Context, model: bpy.types.Object) -> None:
        """Add it."""
        splash = context.scene.objects.get(self.splash)
        if not is_splash(splash):
            raise SceneError(
                f"There is no splash '{self.splash}' in this scene: choose another one"
            )
        model_parts.add_parts(model, [splash])


class SPLASH_OT_part_remove(ModelOperator, bpy.types.Operator):
    """Take the active splash out of the model and show it again"""

    bl_idname = "splash.part_remove"
    bl_label = "Remove Splash"

    def change(self, _context: bpy.types.Context, model: bpy.types.Object) -> None:
        """Remove it."""
        group = model.splash_model
        if not 0 <= group.active < len(group.parts):
            raise SceneError("The model has no splashes: add one first")
        model_parts.remove_part(model, group.active)


class SPLASH_OT_model_update(ModelOperator, bpy.types.Operator):
    """Join the splashes again, after you moved some of them or an obstacle"""

    bl_idname = "splash.model_update"
    bl_label = "Update"

    def change(self, _context: bpy.types.Context, model: bpy.types.Object) -> None:
        """Leave the list as it is."""


class SPLASH_MT_parts(bpy.types.Menu):
    """Add a splash to the model"""

    bl_idname = "SPLASH_MT_parts"
    bl_label = "Add Splash"

    def draw(self, context: bpy.types.Context) -> None:
        """Show the splashes that are in no model yet."""
        free = [item for item in index.splashes(context.scene) if not models_of(item)]
        for item in free:
            entry = self.layout.operator(SPLASH_OT_part_add.bl_idname, text=item.name)
            entry.splash = item.name
        if not free:
            self.layout.label(text="No other splash in this scene")


register, unregister = bpy.utils.register_classes_factory(
    (
        SPLASH_OT_generate_layers,
        SPLASH_OT_combine,
        SPLASH_OT_part_add,
        SPLASH_OT_part_remove,
        SPLASH_OT_model_update,
        SPLASH_MT_parts,
    )
)
