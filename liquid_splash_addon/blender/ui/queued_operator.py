# SPDX-License-Identifier: GPL-3.0-or-later
"""What operators share whose work goes through the queue."""

from __future__ import annotations

from typing import Any

import bpy

from ..jobs import problems, work_queue
from ..jobs.job import redraw_sidebars
from ..jobs.messages import sentence_for
from ..jobs.problems import Check
from ..jobs.work_queue import Entry, Work
from ..scene.objects import SceneError

TICK = 0.1
"""Seconds between two checks of the work."""

_timers: dict[Entry, tuple[int, bpy.types.Timer]] = {}
"""Of the operators that wait: the address of their window, and the timer that wakes them."""


class QueuedOperator:
    """An operator that waits for its work, so that Blender's undo knows of the result.

    Scripts, the background and the redo panel have it done at once. An error of any kind is
    reported in words; the scene is then as it was.

    Attributes
    ----------
    beside : whether a process of its own does the work, so that other work need not wait
    """

    beside = False

    @classmethod
    def is_free(cls) -> bool:
        """Whether no other such operator waits; else say so in the tooltip."""
        if work_queue.collecting(cls.beside) is None:
            return True
        cls.poll_message_set("A splash is being made: press Esc to stop it")
        return False

    def begin(self, context: bpy.types.Context) -> None:
        """Take note of what is meant: what is selected may change while it is computed."""
        raise NotImplementedError

    def read(self) -> Work:
        """Read the work from the scene as it is now. Raises ValueError with what to do."""
        raise NotImplementedError

    def owner(self) -> int:
        """Return the session_uid of the object that it is about; 0 for none."""
        return 0

    def about(self) -> int:
        """Return the session_uid of the object in whose panel an error is shown; 0 for all."""
        return self.owner()

    def cause(self) -> Check | None:
        """Return what looks whether the cause of an error is still there, if that can be seen."""
        return None

    def failed(self, error: Exception) -> None:
        """Keep an error where else the user finds it later."""

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Do the work at once; not in a render, where nothing is to be written."""
        manager = context.window_manager
        manager.progress_begin(0, 100)
        try:
            if work_queue.is_locked():
                raise SceneError("Blender is rendering or baking: wait until it is done")
            self.begin(context)
            work = self.read()
            work.write(work.compute(lambda _, done: manager.progress_update(100 * done)))
            work_queue.note_use()
        except Exception as error:
            return self.give_up(error)
        finally:
            manager.progress_end()
        return self.done()

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Do the work in another thread, while Blender stays usable."""
        if bpy.app.background:
            return self.execute(context)
        try:
            self.begin(context)
            self.read()  # says at once what stands in the way
        except Exception as error:
            return self.give_up(error)
        self._entry = Entry(self.owner(), self.read, lambda error: None, True, self.beside)
        self._entry.window = context.window.as_pointer()
        work_queue.put(self._entry, first=True)
        manager = context.window_manager
        manager.progress_begin(0, 100)
        timer = manager.event_timer_add(TICK, window=context.window)
        _timers[self._entry] = self._entry.window, timer
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Show progress, stop on Esc, write the result when it is there."""
        entry = self._entry
        if event.type == "ESC" and event.value == "PRESS":
            entry.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        show_progress(context, entry)
        if entry.error is None and entry.is_ready:
            return self.collect(context)
        if entry.error is None and not entry.is_dropped:
            return {"PASS_THROUGH"}
        self.leave(context)
        return self.give_up(entry.error) if entry.error is not None else self.stopped()

    def collect(self, context: bpy.types.Context) -> set[str]:
        """Write what was made, unless something else is wanted by now."""
        from ...core.progress import Cancelled

        try:
            if not work_queue.collect(self._entry):
                return {"PASS_THROUGH"}
        except Cancelled:
            self.leave(context)
            return self.stopped()
        except Exception as error:
            self.leave(context)
            return self.give_up(error)
        self.leave(context)
        return self.done()

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop, because Blender ends the operator: another file is opened, or Blender quits."""
        self.leave(context)

    def leave(self, context: bpy.types.Context) -> None:
        """Take the entry out of the queue and the progress from the screen."""
        work_queue.drop(self._entry)
        forget(self._entry)

    def done(self) -> set[str]:
        """Forget what stood in the way before."""
        problems.clear(self.about(), self.tried())
        return {"FINISHED"}

    def tried(self) -> str:
        """Return the name under which errors are kept: a later success clears them."""
        return str(self.bl_idname)  # type: ignore[attr-defined]

    def stopped(self) -> set[str]:
        """Say that it was stopped."""
        self.report({"INFO"}, "Stopped: nothing was changed")
        return {"CANCELLED"}

    def give_up(self, error: Exception) -> set[str]:
        """Report an error. Those that no user can mend go to the console as well."""
        work_queue.print_unexpected(error)
        sentence = sentence_for(error)
        self.report({"ERROR"}, sentence)
        try:
            problems.add(self.about(), self.tried(), sentence, self.cause())
        except AttributeError:  # it failed before it knew what it is about
            problems.add(0, self.tried(), sentence)
        self.failed(error)
        return {"CANCELLED"}


def show_progress(context: bpy.types.Context, entry: Any) -> None:
    """Show the progress in the status bar, at the pointer and in the sidebars."""
    text = f"Splash: {entry.line} ({entry.fraction:.0%}). Press Esc to stop"
    context.workspace.status_text_set("Splash: stopping" if entry.is_stopping else text)
    context.window_manager.progress_update(100 * entry.fraction)
    redraw_sidebars()


def forget(entry: Entry) -> None:
    """Take an operator's timer and its progress from the screen."""
    address, timer = _timers.pop(entry, (0, None))
    manager = bpy.context.window_manager
    if timer is None:
        return
    if any(window.as_pointer() == address for window in manager.windows):  # else they went with it
        manager.event_timer_remove(timer)
    manager.progress_end()
    for window in manager.windows:
        window.workspace.status_text_set(None)


def register() -> None:
    """Nothing waits yet."""


def unregister() -> None:
    """Clean up after operators that waited: Blender ends them without telling them."""
    for entry in [*_timers]:
        forget(entry)
