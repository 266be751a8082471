# SPDX-License-Identifier: GPL-3.0-or-later
"""Refine a splash anew whenever its list of refinements changes, like a stack of modifiers.

Always from the generator's output, which is stored with the mesh, never from the refined mesh.
In a window the work is done in a thread and a timer writes what it made; in the background it
is done at once.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import bpy

from . import mesh_object
from .generation import SceneError, by_uid, check_writable, frame_from_text
from .job import STOP_SECONDS, Job, redraw_sidebars
from .obstacles import obstacles_of
from .properties import plain
from .refinements import steps_of

if TYPE_CHECKING:
    from ..core.alignment import Frame
    from ..core.meshing import Mesh
    from ..core.obstacles import Obstacle
    from ..core.pipeline import Drops, Report
    from ..core.refinement.settings import RefinementSettings
    from ..core.refinement.stack import Refiner

TICK = 0.03
"""Seconds between two looks at the thread."""


@dataclass(frozen=True)
class Task:
    """All that refining a splash needs, read from the scene."""

    splash: int  # session_uid
    fields: bytes
    threshold: float
    frame: Frame
    steps: list[RefinementSettings]
    obstacles: list[Obstacle]
    clearance: float

    @property
    def name(self) -> str:
        """What tells it from any other task: the splash's fields and its settings."""
        source = hashlib.sha256(self.fields).hexdigest()[:16]
        return f"{source} {self.threshold} {self.steps!r} {self.around!r}"

    @property
    def around(self) -> tuple[str, float]:
        """What tells its obstacles from any others."""
        digest = hashlib.sha256()
        for obstacle in self.obstacles:
            digest.update(obstacle.triangles.tobytes())
        return digest.hexdigest()[:16], self.clearance


@dataclass(frozen=True)
class Outcome:
    """What refining a splash made, in its own units."""

    mesh: Mesh
    drops: Drops
    gained: list[float]
    warnings: list[str]


def task_of(splash: bpy.types.Object) -> Task:
    """Read what is needed; SceneError if the splash cannot be refined."""
    check_writable(splash)
    fields = splash.data.get(mesh_object.FIELDS)
    if not fields or not splash.splash.frame:
        raise SceneError(f"'{splash.name}' has no stored liquid: generate it again")
    return Task(
        splash.session_uid,
        bytes(fields),
        plain(splash.splash.settings.surface_threshold),
        frame_from_text(splash.splash.frame),
        steps_of(splash),
        *obstacles_of(splash),
    )


refiner: tuple[tuple[bytes, float, str, float], Refiner] | None = None
"""The last splash's, with what it kept of its steps."""


def compute(task: Task, report: Report) -> Outcome:
    """Refine; no bpy here. ValueError if the stored liquid is damaged."""
    global refiner
    from ..core.fields import Fields
    from ..core.pipeline import drops_to_drawing, to_drawing
    from ..core.refinement.stack import Refiner

    key = (task.fields, task.threshold, *task.around)
    if refiner is None or refiner[0] != key:
        obstacles = [obstacle.seen_from(task.frame) for obstacle in task.obstacles]
        fields = Fields.from_bytes(task.fields)
        refiner = key, Refiner(fields, task.threshold, obstacles, task.clearance)
    refined = refiner[1].refine(task.steps, report)
    return Outcome(
        to_drawing(refined.mesh, task.frame),
        drops_to_drawing(refined.cloud, task.frame),
        refined.gained,
        refined.warnings,
    )


def write(task: Task, outcome: Outcome) -> None:
    """Write the refined mesh; nothing happens if the splash went away meanwhile."""
    splash = by_uid(task.splash)
    if splash is None:
        return
    check_writable(splash)
    mesh_object.write_mesh(splash.data, outcome.mesh)
    remember(splash, task.name, outcome.gained, outcome.warnings)


def remember(splash: bpy.types.Object, name: str, gained: list[float], said: list[str]) -> None:
    """Note with what the mesh was made, and what the refinements had to say."""
    stack = splash.splash_stack
    stack.evaluated = name
    stack.summary = f"Volume {sum(gained):+.1%}" if gained else ""
    stack.warnings = "\n".join(dict.fromkeys(said))


def evaluate(splash: bpy.types.Object) -> None:
    """Refine ``splash`` now. Raises SceneError, and ValueError for damaged fields."""
    task = task_of(splash)
    write(task, compute(task, lambda stage, share: None))


_waiting: set[int] = set()
_running: tuple[Task, Job] | None = None


def request(splash: bpy.types.Object) -> None:
    """See to it that ``splash`` is refined anew, soon; at once where there is no window.

    What stands in the way becomes the splash's warning, and the mesh stays as it is.
    """
    if not splash.splash.is_splash:
        return
    if bpy.app.background:
        _tell(splash.session_uid, partial(evaluate, splash))
        return
    _waiting.add(splash.session_uid)
    if _running is not None and _running[0].splash == splash.session_uid:
        _running[1].cancel()
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=TICK)


def stage_of(splash: bpy.types.Object) -> str:
    """Return what is being done to ``splash`` now; nothing if it is as its list says."""
    if _running is not None and _running[0].splash == splash.session_uid:
        return f"{_running[1].stage} ..."
    return "Waiting ..." if splash.session_uid in _waiting else ""


def _tick() -> float | None:
    """Write what is done, begin what waits; None ends the timer."""
    global _running
    redraw_sidebars()
    if _running is not None:
        if not _running[1].is_done:
            return TICK
        task, job = _running
        _running = None
        _tell(task.splash, partial(_collect, task, job))
    while _waiting and _running is None:
        splash = by_uid(_waiting.pop())
        if splash is not None:
            _tell(splash.session_uid, partial(_begin, splash))
    return TICK if _running is not None else None


def _begin(splash: bpy.types.Object) -> None:
    global _running
    task = task_of(splash)
    if task.name != splash.splash_stack.evaluated:
        _running = task, Job(partial(compute, task))


def _collect(task: Task, job: Job) -> None:
    from ..core.pipeline import Cancelled

    try:
        outcome = job.result()
    except Cancelled:
        return
    write(task, outcome)


def _tell(uid: int, action: Any) -> None:
    """Run ``action``; what stands in its way becomes the splash's warning."""
    try:
        action()
    except ValueError as error:
        splash = by_uid(uid)
        if splash is not None:
            splash.splash_stack.warnings = str(error)


@bpy.app.handlers.persistent
def refresh(_scene: Any, _graph: Any = None) -> None:
    """After undo and redo: refine those splashes whose mesh is not what their list says."""
    for splash in bpy.data.objects:
        if splash.splash.is_splash and splash.splash_stack.evaluated:
            request(splash)


HANDLERS = (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post)


def register() -> None:
    """Follow undo and redo."""
    for handlers in HANDLERS:
        handlers.append(refresh)


def unregister() -> None:
    """Stop what is running and forget what was kept."""
    global _running, refiner
    for handlers in HANDLERS:
        handlers.remove(refresh)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if _running is not None:
        _running[1].cancel()
        _running[1].wait(STOP_SECONDS)
    _waiting.clear()
    _running = refiner = None
