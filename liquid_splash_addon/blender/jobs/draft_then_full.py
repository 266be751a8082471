# SPDX-License-Identifier: GPL-3.0-or-later
"""A splash without an operator that waits for it: a draft first, then the full resolution.

Both go through the queue, so that whoever asked goes on drawing. Strokes that are added meanwhile
are in the result, see work_queue. A newer request takes the place of an older one. A sketch grows
stroke by stroke: one that has outgrown its splash's box gets a new one.

Drafts are bare liquid, as soon as can be; refinements come with the full resolution, or when that
is not made.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import bpy

from ..data.properties import assign_settings, to_settings
from ..scene import evaluated
from ..scene.objects import Handle, SceneError
from ..scene.targets import Target, find_target, target_of
from . import generate, scheduler, undo_step, work_queue
from .messages import sentence_for
from .work_queue import Entry, Work

if TYPE_CHECKING:
    from ...core.settings import SplashSettings

DRAFT = "64"
"""Resolution of drafts."""

BARE_DRAFT = "bare draft"
"""Recorded in place of a key where a list of refinements is yet to come: no task has it."""

NO_SKETCH = "Draw at least one stroke first"

Tell = Callable[[str], None]


class Making:
    """A splash in the making.

    Attributes
    ----------
    stage : "draft", "full", "done" or "failed"
    entry : its place in the queue
    rest : seconds between the draft and the full resolution
    is_step : whether each result is an undo step
    """

    def __init__(self, target: Target, tell: Tell, rest: float = 0.0, is_step: bool = True) -> None:
        """Put the draft into the queue; the full resolution at once where that is wanted."""
        self.sketch = Handle.of(target.sketch)
        self.others = [Handle.of(item) for item in target.others]
        self.splash = None if target.splash is None else Handle.of(target.splash)
        self.tell, self.rest, self.is_step = tell, rest, is_step
        self._is_bare = False  # whether what is shown is a draft without its refinements
        self._after_rest = self._put  # one object: timers are known by identity
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
        """Stop; what was written stays, and a draft gets its refinements."""
        self.give_way()
        self._refine_draft()

    def give_way(self) -> None:
        """Stop, as something else is made in place of it."""
        self.entry.cancel()
        self.forget_rest()

    def _refine_draft(self) -> None:
        """Have a draft refined that stays."""
        splash = self.splash.find() if self.splash is not None and self._is_bare else None
        self._is_bare = False
        if splash is not None:
            scheduler.request(splash)

    def forget_rest(self) -> None:
        """Do not begin what waits for the rest to end."""
        if bpy.app.timers.is_registered(self._after_rest):
            bpy.app.timers.unregister(self._after_rest)

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
        request = generate.snapshot(bpy.context, target, settings, may_refit=True)
        if self.stage == "draft":
            request = replace(request, refinements=[])
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
        is_again, self.splash = self.splash is not None, Handle.of(splash)
        self._is_bare = is_again and self.stage == "draft" and len(splash.splash_stack.items) > 0
        if self._is_bare:
            evaluated.remember(splash, splash.splash_stack, BARE_DRAFT)
        if self.is_step:
            undo_step.push("Splash Preview" if self.stage == "draft" else "Generate Splash")
        self.tell(result.summary)
        if self.stage == "full":
            self.stage = "done"
            return
        self.stage = "full"
        if self.rest:
            bpy.app.timers.register(self._after_rest, first_interval=self.rest)
        else:
            self._put()

    def _fail(self, error: Exception) -> None:
        self.stage = "failed"
        self._refine_draft()
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
    target = find_target(context)
    if target is None:
        raise SceneError(NO_SKETCH)
    make(target, tell)


def make(target: Target, tell: Tell, rest: float = 0.0, is_step: bool = True) -> None:
    """Have a splash made, without waiting for it, in the place of what was asked for before."""
    global _making
    if _making is not None and _making.is_busy:
        _making.give_way()
    _making = Making(target, tell, rest, is_step)


@bpy.app.handlers.persistent
def forget(_file: Any = None, _unused: Any = None) -> None:
    """Forget what was asked for: its objects are going."""
    global _making
    if _making is not None:
        _making.forget_rest()
    _making = None


def register() -> None:
    """Nothing waits yet."""
    bpy.app.handlers.load_pre.append(forget)


def unregister() -> None:
    """Stop, and forget."""
    bpy.app.handlers.load_pre.remove(forget)
    if _making is not None:
        _making.give_way()
    forget()
