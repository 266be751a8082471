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
from ..data.properties import is_splash
from ..scene.mesh_object import world_matrix
from ..scene.objects import SceneError
from . import compose, refine
from .progress import part_of

if TYPE_CHECKING:
    from ...core.animation.solver_start import SolverStart
    from ...core.progress import Report


@dataclass(frozen=True)
class StartTask:
    """What the start of a splash or a model is made from, as read from the scene.

    Attributes
    ----------
    name : of the object
    task : of its liquid
    matrix : float64 ``(4, 4)``, from the object's space to the world
    """

    name: str
    task: refine.Task | compose.ModelTask
    matrix: np.ndarray

    @property
    def key(self) -> str:
        """Identifies the start: equal keys, equal liquid in the same place."""
        task = self.task
        if isinstance(task, compose.ModelTask):
            liquid = replace(task, waves=None).key
        else:
            liquid = compose.PartTask(self.name, task, np.eye(4)).key
        return f"{liquid} {np.round(self.matrix, 6).tolist()}"


def read_start(item: bpy.types.Object | None) -> StartTask:
    """Read what the start of ``item``, a splash or a model, is made from; linked ones too.

    Raises SceneError if it is neither, or has no stored liquid.
    """
    if item is None or not (is_model(item) or is_splash(item)):
        raise SceneError("Select a splash or a model first")
    task = compose.read_task(item) if is_model(item) else refine.read_task(item)
    return StartTask(item.name, task, np.array(world_matrix(item), dtype=np.float64))


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
        raise SceneError(f"'{start.name}' has no liquid: lower its Surface Threshold")
    return made


def of_splash(start: StartTask) -> SolverStart:
    """Return the start of a splash."""
    from ...core.animation.solver_start import SolverStart

    task = start.task
    assert isinstance(task, refine.Task)
    world = compose.frame_in_model(task.frame, start.matrix, start.name)
    obstacles = [obstacle.seen_from(task.frame) for obstacle in task.obstacles]
    detail = refine.refiner_of(task).liquid(task.steps)
    return SolverStart.of_splash(detail, task.frame, world, obstacles, task.clearance)


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
    frame = Frame(np.eye(3), np.zeros(3), finest(parts).frame.scale)
    world = compose.frame_in_model(frame, start.matrix, start.name)
    return SolverStart.of_model(blocks, drops, frame, world, task.obstacles, task.clearance)
