# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators that simulate splashes and look after their frames."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import bpy

from ..data.model import is_model
from ..data.properties import is_splash
from ..jobs import main_thread, simulate, work_queue
from ..jobs.work_queue import Work
from ..scene import frame_folder, motion_object, saved_elsewhere
from ..scene.objects import Handle, SceneError
from ..scene.targets import shown_splash
from .queued_operator import QueuedOperator

SHOW_SECONDS = 2.0
"""Between two looks of the playing object at what has become ready meanwhile."""


def liquid_of(item: bpy.types.Object | None) -> bpy.types.Object | None:
    """Return a splash or model itself, or that of its drops or its motion; None for others."""
    if item is None or item.type != "MESH":
        return None
    if is_splash(item) or is_model(item):
        return item
    owner = item.splash.owner if item.is_property_set("splash") else None
    return owner if owner is not None and (is_splash(owner) or is_model(owner)) else None


def simulated_item(context: bpy.types.Context) -> bpy.types.Object | None:
    """Find the splash or model that is meant: that of the active drops or motion too."""
    return liquid_of(context.active_object) or shown_splash(context)


def wanted(context: bpy.types.Context) -> list[bpy.types.Object]:
    """List the splashes and models that are selected, the active one first."""
    found = [simulated_item(context), *map(liquid_of, context.selected_objects)]
    return list(dict.fromkeys(item for item in found if item is not None))


def is_idle(operator: Any, context: bpy.types.Context) -> bool:
    """Whether none of what is selected is being made, or baked; else say so in the tooltip."""
    entry = work_queue.collecting()
    if entry is None or entry.owner not in {item.session_uid for item in wanted(context)}:
        return True
    operator.poll_message_set("A splash is being made: press Esc to stop it")
    return False


class LiquidOperator(QueuedOperator):
    """What these operators share."""

    beside = True

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there is a splash, and no other run."""
        if simulated_item(context) is None:
            cls.poll_message_set("Select a splash or a model")
            return False
        return cls.is_free() and is_idle(cls, context)

    @classmethod
    def is_free(cls) -> bool:
        """Whether nothing is simulated; else say so in the tooltip."""
        if work_queue.collecting(cls.beside) is None:
            return True
        cls.poll_message_set("A simulation is running: press Esc to stop it")
        return False


class FramesOperator(LiquidOperator):
    """An operator that makes frames which are played meanwhile; what is done is kept.

    Attributes
    ----------
    show, write_run : have what is done of a run played; record it as well
    """

    show: Callable[[Any], None]
    write_run: Callable[[Any], None]

    def begin_runs(
        self, items: Sequence[bpy.types.Object], read: Callable[[bpy.types.Object], Any]
    ) -> None:
        """Read what is meant. What cannot be made is reported, and the others are done."""
        self._runs: list[Any] = []
        self._shown_at, self._failures = 0.0, []
        for item in items:
            try:
                self._runs.append(read(item))
            except ValueError as error:
                self._failures.append(str(error))
        if not self._runs:
            raise SceneError(self._failures[0])
        for failure in self._failures:
            self.report({"WARNING"}, failure)

    def owner(self) -> int:
        """Return the first splash or model."""
        return int(self._runs[0].order.item.uid)

    def played(self) -> int:
        """Return how many frames can be played."""
        return sum(run.played for run in self._runs)

    def write(self, _result: Any = None) -> None:
        """Record what was made. Raises SceneError if nothing was."""
        main_thread.do_requests()
        for run in self._runs:
            self.write_run(run)
        failed = [run for run in self._runs if run.error]
        if len(failed) == len(self._runs) and not self.played():
            raise SceneError(failed[0].error)
        for run in failed:
            self.report({"WARNING"}, f"{run.order.item.name}: {run.error}")

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Show meanwhile what is ready."""
        now = time.monotonic()
        if event.type == "TIMER" and now - self._shown_at > SHOW_SECONDS:
            self._shown_at = now
            if not work_queue.is_locked():
                for run in self._runs:
                    self.show(run)
        return super().modal(context, event)

    def stopped(self) -> set[str]:
        """Keep what is done."""
        try:
            self.write()
        except SceneError:
            pass
        if not self.played():
            return super().stopped()
        self.report({"INFO"}, "Stopped: what is done was kept, the button goes on")
        return {"FINISHED"}


class SPLASH_OT_simulate(FramesOperator, bpy.types.Operator):
    """Simulate how the selected splashes move on, or go on where that was stopped"""

    bl_idname = "splash.simulate"
    bl_label = "Simulate Splash"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    show, write_run = staticmethod(simulate.show), staticmethod(simulate.write)

    def begin(self, context: bpy.types.Context) -> None:
        """Read what is meant."""
        self.begin_runs(
            wanted(context), lambda item: simulate.Run(simulate.read_order(context, item))
        )

    def read(self) -> Work:
        """Return the work: what was read at first, as obstacles may have been simulated by now."""
        return Work(id(self), partial(simulate.simulate_all, self._runs), self.write)


class SPLASH_OT_simulation_stop(bpy.types.Operator):
    """Stop the simulation. What is done is kept"""

    bl_idname = "splash.simulation_stop"
    bl_label = "Stop"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """Whether something is simulated."""
        return work_queue.collecting(beside=True) is not None

    def execute(self, _context: bpy.types.Context) -> set[str]:
        """Stop it, as Esc does."""
        entry = work_queue.collecting(beside=True)
        if entry is not None:
            entry.cancel()
        return {"FINISHED"}


class SPLASH_OT_simulation_delete(bpy.types.Operator):
    """Delete the simulated frames of the splash"""

    bl_idname = "splash.simulation_delete"
    bl_label = "Delete Frames"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there are frames, and no run."""
        item = simulated_item(context)
        if item is None or not item.splash_simulation.folder:
            cls.poll_message_set("The splash has no simulated frames")
            return False
        is_free = LiquidOperator.is_free.__func__(cls)  # type: ignore[attr-defined]
        return bool(is_free) and is_idle(cls, context)

    beside = True

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Ask first: files do not come back by undo."""
        return set(context.window_manager.invoke_confirm(self, event))

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Delete the files, unless copies play them too, and what plays them."""
        item = simulated_item(context)
        record, folder = item.splash_simulation, frame_folder.folder_of(item)
        if not item.is_editable:
            self.report(
                {"ERROR"}, f"'{item.name}' is linked from another file: make it local first"
            )
            return {"CANCELLED"}
        try:
            if not frame_folder.is_shared(item) and folder is not None:
                frame_folder.delete(folder)
        except OSError as error:
            self.report({"ERROR"}, f"The frames in {folder} cannot be deleted ({error.strerror})")
            return {"CANCELLED"}
        motion_object.remove(item)
        record.folder, record.frames, record.wanted, record.made_of = "", 0, 0, ""
        record.is_baked = False
        record.summary = record.warnings = ""
        return {"FINISHED"}


class SPLASH_OT_simulation_keep(LiquidOperator, bpy.types.Operator):
    """Move the simulated frames from the temporary folder to one beside the saved file"""

    bl_idname = "splash.simulation_keep"
    bl_label = "Move Beside File"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether there are such frames, and the file has a place."""
        if not super().poll(context):
            return False
        if not bpy.data.filepath:
            cls.poll_message_set("Save the file first")
            return False
        return frame_folder.is_temporary(simulated_item(context).splash_simulation.folder)

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of the folders."""
        item = simulated_item(context)
        self._item, self._folder = Handle.of(item), frame_folder.folder_for(item)
        self._before = frame_folder.folder_of(item)
        self._after = frame_folder.absolute(item, self._folder)

    def read(self) -> Work:
        """Return the work: to move them may be to copy them to another disk."""
        return Work(id(self), self.move, self.write)

    def move(self, report: Any) -> None:
        """Move them. Raises OSError."""
        report("Moving the frames", 0.0)
        frame_folder.move(self._before, self._after)

    def write(self, _result: None) -> None:
        """Play them from where they are now."""
        item = self._item.find()
        if item is not None:
            saved_elsewhere.set_folder(item, self._folder)


CLASSES = (
    SPLASH_OT_simulate,
    SPLASH_OT_simulation_stop,
    SPLASH_OT_simulation_delete,
    SPLASH_OT_simulation_keep,
)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
