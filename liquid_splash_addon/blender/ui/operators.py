# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that make a splash or a sketch; jobs.generate and scene.sketch do the work."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import bpy

from ...core.settings import SplashSettings
from ...core.sketch.strokes import StrokeError
from ..data.properties import assign_settings, settings_properties, to_settings
from ..jobs import dependencies, generate, job
from ..scene import sketch, targets
from ..scene.objects import SceneError

TICK = 0.1
"""Seconds between two checks of the running job."""


def user_errors() -> tuple[type[Exception], ...]:
    """List the errors whose message is meant for the user; any other is a bug."""
    from ...core.generator.weights_file import TorchMissingError, WeightsError
    from ...core.obstacles.obstacles import ObstacleError

    return (StrokeError, SceneError, ObstacleError, WeightsError, TorchMissingError)


class SplashMaker:
    """What the operators that make a splash share.

    Their properties are the settings, for the redo panel and for scripts. Those that are not set
    are taken from the splash, or from the scene for a new splash.
    """

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    # Not remembered from one splash to the next: each has settings of its own.
    __annotations__ = settings_properties(options={"SKIP_SAVE"})
    realign = False
    needs_splash = True
    compute = staticmethod(generate.compute)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a sketch to start from, and no other run."""
        target = targets.find_target(context)
        if job.running is not None:
            cls.poll_message_set("A splash is being made: press Esc to stop it")
        elif target is None:
            cls.poll_message_set(
                "Select a Grease Pencil sketch, or a splash whose sketch still exists"
            )
        elif cls.needs_splash and target.splash is None:
            cls.poll_message_set("This sketch has no splash yet: generate one first")
        else:
            return True
        return False

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Make the splash at once: for scripts, the background and the redo panel."""
        manager = context.window_manager
        manager.progress_begin(0, 100)
        try:
            request = self.request(context)
            result = self.compute(request, lambda _, done: manager.progress_update(100 * done))
            self.write_result(context, request, result)
        except user_errors() as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            manager.progress_end()
        return {"FINISHED"}

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Make the splash in another thread, while Blender stays usable."""
        if bpy.app.background:
            return self.execute(context)
        try:
            self._request = self.request(context)
        except user_errors() as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        job.start(partial(type(self).compute, self._request))
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self._timer = manager.event_timer_add(TICK, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Show progress, stop on Esc, write the result when it is done."""
        if event.type == "ESC" and event.value == "PRESS":
            job.running.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        show_progress(context)
        return self.collect(context) if job.running.is_done else {"PASS_THROUGH"}

    def collect(self, context: bpy.types.Context) -> set[str]:
        """End the modal state and write what the job made."""
        from ...core.progress import Cancelled

        try:
            with leaving(self, context):
                self.write_result(context, self._request, job.running.result())
        except Cancelled:
            self.report({"INFO"}, "Splash cancelled")
            return {"CANCELLED"}
        except user_errors() as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop, because Blender ends the operator: another file is opened, or Blender quits."""
        job.stop()
        with leaving(self, context):
            pass

    def request(self, context: bpy.types.Context) -> Any:
        """Take a snapshot of the scene, and set the operator's properties to the settings used."""
        target = targets.find_target(context)
        owner = target.splash if target.splash is not None else context.scene
        settings = self.chosen_settings(to_settings(owner.splash.settings))
        request = generate.snapshot(context, target, settings, self.realign)
        assign_settings(self, settings)
        return request

    def chosen_settings(self, stored: SplashSettings) -> SplashSettings:
        """Return the stored settings, replaced by those that this operator was given."""
        given = {
            name: value
            for name, value in vars(to_settings(self)).items()
            if self.properties.is_property_set(name)
        }
        return SplashSettings(**(vars(stored) | given))

    def write_result(self, context: bpy.types.Context, request: Any, result: Any) -> None:
        """Write the result and report what was made."""
        splash = generate.write(context, request, result)
        self.report({"INFO"}, f"{splash.name}: {result.summary}")
        for warning in result.warnings:
            self.report({"WARNING"}, warning)


def show_progress(context: bpy.types.Context) -> None:
    """Show the progress in the status bar, at the pointer and in the sidebars."""
    running = job.running
    text = f"Splash: {running.stage} ({running.fraction:.0%}). Press Esc to stop"
    context.workspace.status_text_set("Splash: stopping" if running.is_stopping else text)
    context.window_manager.progress_update(100 * running.fraction)
    job.redraw_sidebars()


@contextmanager
def leaving(operator: Any, context: bpy.types.Context) -> Iterator[None]:
    """Remove the progress display after the block, whatever happens in it."""
    try:
        yield
    finally:
        job.forget()
        context.window_manager.event_timer_remove(operator._timer)
        context.window_manager.progress_end()
        if context.workspace is not None:
            context.workspace.status_text_set(None)


class SPLASH_OT_generate(SplashMaker, bpy.types.Operator):
    """Turn the strokes of the active sketch into a splash, or update its splash"""

    bl_idname = "splash.generate"
    bl_label = "Generate Splash"
    needs_splash = False


class SPLASH_OT_regenerate(SplashMaker, bpy.types.Operator):
    """Make the splash again from its sketch and settings, in the same local frame"""

    bl_idname = "splash.regenerate"
    bl_label = "Regenerate"


class SPLASH_OT_realign(SplashMaker, bpy.types.Operator):
    """Fit the local frame to the strokes again and make the splash again"""

    bl_description = (
        "Fit the local frame to the strokes again and make the splash again. Otherwise the frame "
        "is kept while you edit the strokes, so that the splash does not jump"
    )
    bl_idname = "splash.realign"
    bl_label = "Realign"
    realign = True


class SPLASH_OT_new_sketch(bpy.types.Operator):
    """Add a Grease Pencil object at the 3D cursor and start to draw"""

    bl_description = (
        "Add a Grease Pencil object at the 3D cursor and start to draw. Strokes lie on a plane "
        "through the cursor that faces the view: turn the view, or move the cursor, between "
        "strokes to draw in 3D. How fast you draw is how fast the liquid moves"
    )
    bl_idname = "splash.new_sketch"
    bl_label = "New Sketch"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether the mode of the active object can be left."""
        active = context.active_object
        if active is not None and active.mode == "EDIT" and active.type != "GREASEPENCIL":
            cls.poll_message_set("Leave Edit Mode first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Add the object and enter draw mode."""
        sketch.start_drawing(context, sketch.new_sketch(context))
        return {"FINISHED"}


class SPLASH_OT_copy_install_command(bpy.types.Operator):
    """Copy the command that installs the missing packages, to run it in a terminal"""

    bl_idname = "splash.copy_install_command"
    bl_label = "Copy Command"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Copy the command."""
        context.window_manager.clipboard = dependencies.install_command()
        self.report({"INFO"}, "Command copied. Run it in a terminal, then restart Blender")
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory(
    (
        SPLASH_OT_generate,
        SPLASH_OT_regenerate,
        SPLASH_OT_realign,
        SPLASH_OT_new_sketch,
        SPLASH_OT_copy_install_command,
    )
)
