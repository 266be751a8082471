# SPDX-License-Identifier: GPL-3.0-or-later
"""A splash without an operator that waits for it: a draft first, then the full resolution.

Both go through the queue, so that whoever asked goes on drawing. Strokes that are added meanwhile
are in the result, see work_queue. A newer request takes the place of an older one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import bpy

from ..data.properties import assign_settings, to_settings
from ..scene.objects import Handle, SceneError
from ..scene.targets import Target, find_target, target_of
from . import generate, undo_step, work_queue
from .messages import sentence_for
from .work_queue import Entry, Work

if TYPE_CHECKING:
    from ...core.settings import SplashSettings

DRAFT = "64"
"""Resolution of drafts."""

NO_SKETCH = "Draw at least one stroke first"

Tell = Callable[[str], None]


class Making:
    """A splash in the making.

    Attributes
    ----------
    stage : "draft", "full", "done" or "failed"
    entry : its place in the queue
    """

    def __init__(self, target: Target, tell: Tell) -> None:
        """Put the draft into the queue; the full resolution at once where that is wanted."""
        self.sketch = Handle.of(target.sketch)
        self.others = [Handle.of(item) for item in target.others]
        self.splash = None if target.splash is None else Handle.of(target.splash)
        self.tell = tell
        self.stage = "full" if self.settings().resolution == DRAFT else "draft"
        self._put()

    @property
    def is_busy(self) -> bool:
        """Whether there is more to come."""
        return self.stage in {"draft", "full"} and not self.entry.is_stopping

    @property
    def progress(self) -> tuple[str, float]:
        """What is being done, and the share that is done, 0..1, of this stage."""
        return self.entry.stage, self.entry.fraction

    def cancel(self) -> None:
        """Stop; what was written stays."""
        self.entry.cancel()

    def settings(self) -> SplashSettings:
        """Return the settings of the splash as they are now, those for new ones without one."""
        splash = self.found_splash()
        owner = bpy.context.scene if splash is None else splash
        settings: SplashSettings = to_settings(owner.splash.settings)
        return settings

    def found_splash(self) -> bpy.types.Object | None:
        """Find the splash; None before it is made. Raises SceneError if it was deleted since."""
        if self.splash is None:
            return None
        splash = self.splash.find()
        if splash is None:
            raise SceneError("The splash was deleted meanwhile: generate it again")
        return splash

    def _put(self) -> None:
        self.entry = work_queue.put(Entry(0, self._read, self._fail), first=self.stage == "full")

    def _read(self) -> Work:
        sketch = self.sketch.find()
        if sketch is None:
            raise SceneError("The sketch was deleted meanwhile, so nothing was made")
        settings = self.settings()
        if self.stage == "draft":
            settings = replace(settings, resolution=DRAFT)
        splash = self.found_splash()
        others = tuple(item for handle in self.others if (item := handle.find()) is not None)
        target = Target(sketch, None, "", others) if splash is None else target_of(splash)
        request = generate.snapshot(bpy.context, target, settings)
        return Work(
            (request.key, self.stage),
            partial(generate.compute, request),
            partial(self._write, request),
        )

    def _write(self, request: generate.Request, result: generate.Result) -> None:
        """Write a result, keep the resolution that was asked for, and go on to the next stage."""
        wanted = self.settings()
        splash = generate.write(bpy.context, request, result)
        assign_settings(splash.splash.settings, wanted)
        self.splash = Handle.of(splash)
        undo_step.push("Splash Draft" if self.stage == "draft" else "Generate Splash")
        self.tell(result.summary)
        if self.stage == "draft":
            self.stage = "full"
            self._put()
        else:
            self.stage = "done"

    def _fail(self, error: Exception) -> None:
        self.stage = "failed"
        self.tell(sentence_for(error))


_making: Making | None = None


def making() -> Making | None:
    """Return what was asked for last."""
    return _making


def request(context: bpy.types.Context, tell: Tell) -> None:
    """Have the splash of the active sketch made, without waiting for it.

    tell : is told what was made, or what went wrong, in words
    Raises SceneError where there is no sketch.
    """
    global _making
    target = find_target(context)
    if target is None:
        raise SceneError(NO_SKETCH)
    if _making is not None and _making.is_busy:
        _making.cancel()
    _making = Making(target, tell)


@bpy.app.handlers.persistent
def forget(_file: Any = None, _unused: Any = None) -> None:
    """Forget what was asked for: its objects are going."""
    global _making
    _making = None


def register() -> None:
    """Nothing waits yet."""
    bpy.app.handlers.load_pre.append(forget)


def unregister() -> None:
    """Stop, and forget."""
    bpy.app.handlers.load_pre.remove(forget)
    if _making is not None:
        _making.cancel()
    forget()
