# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in another thread, watched from Blender's own. The work must not touch bpy."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import bpy

if TYPE_CHECKING:
    from ...core.progress import Report

STOP_SECONDS = 30.0
"""How long quitting and unregistering wait for the thread: the generator cannot be interrupted."""


REDRAW_SECONDS = 0.1
"""Between two drawings of the sidebars."""


class Job:
    """One piece of work in a thread.

    Attributes
    ----------
    stage, fraction : what the work last reported
    begun : when it was started, of time.monotonic
    """

    def __init__(self, work: Callable[[Report], Any]) -> None:
        """Start ``work(report)``; once :meth:`cancel` was called, its next ``report`` ends it."""
        self.stage, self.fraction = "Starting", 0.0
        self.begun = time.monotonic()
        self._work = work
        self._result: Any = None
        self._error: BaseException | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="Liquid Splash", daemon=True)
        self._thread.start()

    @property
    def is_done(self) -> bool:
        """Whether the thread has ended."""
        return not self._thread.is_alive()

    @property
    def is_stopping(self) -> bool:
        """Whether :meth:`cancel` was called."""
        return self._stopping.is_set()

    def cancel(self) -> None:
        """Ask the work to end at its next report."""
        self._stopping.set()

    def wait(self, seconds: float | None = None) -> None:
        """Wait for the thread to end."""
        self._thread.join(seconds)

    def result(self) -> Any:
        """Return what the work returned, or raise what it raised; Cancelled after a cancel."""
        from ...core.progress import Cancelled

        self.wait()
        if self._error is not None:
            raise self._error
        if self.is_stopping:  # cancelled after the last report: the work did not notice
            raise Cancelled
        return self._result

    def _report(self, stage: str, fraction: float) -> None:
        from ...core.progress import Cancelled

        if self.is_stopping:
            raise Cancelled
        self.stage, self.fraction = stage, fraction

    def _run(self) -> None:
        try:
            self._result = self._work(self._report)
        except BaseException as error:  # raised again in the thread that asks for the result
            self._error = error


_redrawn = 0.0


def redraw_sidebars() -> None:
    """Have the sidebars of all 3D views drawn again, at most ten times a second."""
    global _redrawn
    now = time.monotonic()
    if now - _redrawn < REDRAW_SECONDS:
        return
    _redrawn = now
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()
