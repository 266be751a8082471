# SPDX-License-Identifier: GPL-3.0-or-later
"""A splash or a model as what solvers and exporters start from, see core's SolverStart.

:func:`read_start` reads the scene, in Blender's thread; :func:`compute_start` then needs no bpy and
may run in another one, by the queue.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ..data.model import is_model
from ..data.properties import is_splash, plain
from ..scene.mesh_space import liquid_matrix
from ..scene.objects import SceneError
from . import compose, refine
from .progress import part_of

if TYPE_CHECKING:
    from ...core.animation.solver_start import SolverStart
    from ...core.progress import Report
    from ...core.sketch.local_frame import Frame


@dataclass(frozen=True)
class StartTask:
    """What the start of a splash or a model is made from, as read from the scene.

    Attributes
    ----------
    name : of the object
    task : of its liquid
    matrix : float64 ``(4, 4)``, from the object's space to the world
    time_scale : of its slow motion
    """

    name: str
    task: refine.Task | compose.ModelTask
    matrix: np.ndarray
    time_scale: float

    @property
    def key(self) -> str:
        """Identifies the start: equal keys, equal liquid in the same place."""
        task = self.task
        if isinstance(task, compose.ModelTask):
            liquid = replace(task, waves=None, sheets=None).key
        else:
            liquid = compose.PartTask(self.name, task, np.eye(4)).key
        return f"{liquid} {np.round(self.matrix, 6).tolist()} {self.time_scale}"

    def slowed(self, frame: Frame) -> tuple[Frame, Frame]:
        """Return the frame in slow motion, in the object's space and in the world."""
        own = replace(frame, scale=frame.scale.slowed(self.time_scale))
        return own, compose.frame_in_model(own, self.matrix, self.name)


def read_start(item: bpy.types.Object | None) -> StartTask:
    """Read what the start of ``item``, a splash or a model, is made from; linked ones too.

    Raises SceneError if it is neither, or has no stored liquid.
    """
    if item is None or not (is_model(item) or is_splash(item)):
        raise SceneError("Select a splash or a model first")
    task = compose.read_task(item) if is_model(item) else refine.read_task(item)
    place = np.array(liquid_matrix(item), dtype=np.float64)
    return StartTask(item.name, task, place, plain(item.splash_motion.time_scale))


def compute_start(start: StartTask, report: Report) -> SolverStart:
    """Return the start, without bpy.

    Raises ValueError (no liquid, stretched, too much memory, damaged fields) with what to do, and
    whatever ``report`` raises.
    """
    made = (
        of_model(start, report) if isinstance(start.task, compose.ModelTask) else of_splash(start)
    )
    report("Done", 1.0)
    if made.is_empty:
        raise SceneError(f"'{start.name}' has no liquid: lower its Thinness")
    return made


def of_splash(start: StartTask) -> SolverStart:
    """Return the start of a splash."""
    from ...core.animation.solver_start import SolverStart

    task = start.task
    assert isinstance(task, refine.Task)
    frame, world = start.slowed(task.frame)
    obstacles = [obstacle.seen_from(task.frame) for obstacle in task.obstacles]
    detail = refine.refiner_of(task).liquid(task.steps)
    return SolverStart.of_splash(detail, frame, world, obstacles, task.clearance)


def of_model(start: StartTask, report: Report) -> SolverStart:
    """Return the start of a model."""
    from ...core.animation.solver_start import SolverStart
    from ...core.composition.model import finest
    from ...core.sketch.local_frame import Frame

    task = start.task
    assert isinstance(task, compose.ModelTask)
    parts = compose.refined_parts(task, report)
    blocks, drops = compose.the_composer().liquid(
        parts, task.settings, task.obstacles, task.clearance, part_of(report, 0.3, 1.0)
    )
    frame, world = start.slowed(Frame(np.eye(3), np.zeros(3), finest(parts).frame.scale))
    return SolverStart.of_model(blocks, drops, frame, world, task.obstacles, task.clearance)
