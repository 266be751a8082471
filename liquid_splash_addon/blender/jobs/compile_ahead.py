# SPDX-License-Identifier: GPL-3.0-or-later
"""Compile ahead in a process of its own what the first splash would otherwise wait for.

It is started when the tab is first shown, unless that was done before. Blender stays usable: the
process runs on one core. A splash that is wanted meanwhile waits until what it needs is there.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from typing import Any

import bpy

from ...core import compiled_code
from ...core.progress import Report, part_of
from . import dependencies
from .child_process import ChildProcess
from .job import redraw_sidebars

DELAY = 1.0
"""Seconds from the first look at the tab to the start: Blender has other things to do first."""

PREPARING = "Preparing (first time only)"

WAITED = 0.8
"""Of the bar of a splash that waits for code to be compiled: the rest is soon done."""

TICK = 0.2
"""Seconds between two looks at the process."""


class Ahead(ChildProcess):
    """The process, and what it last said.

    Attributes
    ----------
    stage, share : what is being done; what is done, 0..1
    failed : why it ended too early; nothing as long as it did not
    note : a sentence for the user where compiled code could not be kept
    """

    def __init__(self) -> None:
        """Start it. Raises OSError where that is not possible."""
        self.stage, self.share, self.failed, self.note = "", 0.0, "", ""
        # An earlier Blender that was closed too early may have done all that a splash waits for.
        is_awaited = not compiled_code.has_reached(compiled_code.REFINED)
        super().__init__({"gives_way": not is_awaited})
        # What needs no networks is compiled beside what does, where there is a core for it.
        with_helper = is_awaited and (os.cpu_count() or 1) > 1
        self._helper = (
            ChildProcess({"module": ".core.rehearsal", "job": {}}) if with_helper else None
        )

    def stop(self) -> None:
        """End it."""
        if self._helper is not None:
            self._helper.stop()
        super().stop()

    def hear(self, said: Mapping[str, Any]) -> None:
        """Take note of what a line says."""
        self.stage = said.get("stage", self.stage)
        self.share = said.get("share", self.share)
        self.failed = said.get("failed", self.failed)
        self.note = said.get("note", self.note)
        if "reached" in said:
            compiled_code.note_reached(said["reached"])

    def end(self) -> None:
        """Note whether all was compiled, or why not."""
        if self.code == 0 and not self.note:
            finish()
        elif self.code != 0 and not self.is_stopped:
            self.failed = self.failed or self.last


def finish() -> None:
    """Note that all was compiled, so that it is not done again."""
    folder = compiled_code.folder()
    if folder is not None:
        try:
            compiled_code.marker(folder).touch()
        except OSError as error:
            compiled_code.explain(f"Compiled code cannot be kept ({error.strerror})")


_ahead: Ahead | None = None
_is_asked = False


def ask() -> None:
    """Have it started soon, once, if there is something to do: for draw(), which must not."""
    global _is_asked
    if _is_asked or bpy.app.background:
        return
    _is_asked = True
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=DELAY, persistent=True)


def start() -> Ahead | None:
    """Start it now, if it does not run; return it. None where it cannot run."""
    global _ahead
    if dependencies.missing_packages():
        return None
    if _ahead is None or _ahead.is_done:
        try:
            _ahead = Ahead()
        except OSError:  # no splash needs it
            _ahead = None
    return _ahead


def want() -> None:
    """Start it, once, if what a splash needs is not compiled yet and nobody waits in background."""
    is_ours = compiled_code.folder() is not None and not bpy.app.background
    if is_ours and _ahead is None and not compiled_code.is_complete():
        start()
        ask()


def wait_for(stage: str, report: Report) -> Report:
    """Wait until all is compiled that a stage needs, as long as that goes on; in a job's thread.

    Compiling in Blender's own process would hold Python's lock, and the interface with it, now and
    then for most of a second. Returns the report for what comes after. Raises Cancelled.
    """
    has_waited = False
    while (ahead := running()) is not None and not compiled_code.has_reached(stage):
        has_waited = True
        report(PREPARING, WAITED * min(ahead.share / compiled_code.REACHED[stage], 1.0))
        time.sleep(TICK)
    return part_of(report, WAITED, 1.0) if has_waited else report


def started(is_refined: bool, report: Report) -> Report:
    """Import PyTorch, and wait for the code that a splash needs, see :func:`wait_for`."""
    from ...core.generator.loading import load_torch

    report("Starting PyTorch", 0.0)
    load_torch()
    return wait_for(compiled_code.REFINED if is_refined else compiled_code.FIRST, report)


def running() -> Ahead | None:
    """Return the process; None if it does not run."""
    return _ahead if _ahead is not None and not _ahead.is_done else None


def note() -> str:
    """Return a sentence for the user if compiled code is not kept, else nothing."""
    if compiled_code.note():
        return compiled_code.note()
    if _ahead is None or not _ahead.is_done:
        return ""
    if _ahead.failed:
        return f"Preparing the first splash failed ({_ahead.failed}): it will take longer"
    return _ahead.note


def _tick() -> float | None:
    """Start the process, and show how far it is until it ends."""
    if _ahead is None:
        is_wanted = compiled_code.folder() is not None and not compiled_code.is_complete()
        if not is_wanted or start() is None:
            return None
    redraw_sidebars()
    return TICK if running() is not None else None


def register() -> None:
    """Let it be asked for."""
    global _is_asked
    _is_asked = False


def unregister() -> None:
    """End the process."""
    global _ahead
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if _ahead is not None:
        _ahead.stop()
    _ahead = None
