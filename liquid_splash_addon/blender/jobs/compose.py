# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluate a model anew whenever it or one of its splashes changes.

From the fields that each splash stores, refined by its own list. When and in which thread: see
scheduler.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.refinement.settings import RefinementSettings, WaveSettings
from ...core.settings import ModelSettings
from ..data.model import SplashPartGroup
from ..data.properties import to_settings
from ..scene import drop_points, mesh_object, model_parts
from ..scene.objects import SceneError, check_writable
from ..scene.obstacles import obstacles_of
from . import refine, scheduler

if TYPE_CHECKING:
    from ...core.composition.model import Composed, Composer, Part
    from ...core.mesh.marching_cubes import Mesh
    from ...core.obstacles.obstacles import Obstacle
    from ...core.pipeline import Report
    from ...core.sketch.local_frame import Frame

UNEVEN = 1e-3
"""Share by which the scales of a splash may differ along its axes."""


@dataclass(frozen=True)
class PartTask:
    """All that a splash adds to a model, read from the scene.

    Attributes
    ----------
    label : the splash's name
    task : what refines it
    place : from the splash's space to the model's, ``(4, 4)``
    applied : its mesh, in its own space, where its refinements were applied
    """

    label: str
    task: refine.Task
    place: np.ndarray
    applied: Mesh | None

    @property
    def steps(self) -> list[RefinementSettings]:
        """Its refinements but for the waves: the model's come after the joint."""
        return [step for step in self.task.steps if not isinstance(step, WaveSettings)]

    @property
    def name(self) -> str:
        """What tells its liquid from any other, wherever it is."""
        frame = (self.task.frame.axes, self.task.frame.centre, self.task.frame.scale)
        digest = hashlib.sha256(repr(frame).encode())
        if self.applied is not None:
            digest.update(self.applied.vertices.tobytes())
            digest.update(self.applied.faces.tobytes())
        return f"{self.task.name_with(self.steps)} {digest.hexdigest()[:16]}"


@dataclass(frozen=True)
class ModelTask:
    """All that a model needs, read from the scene."""

    parts: list[PartTask]
    settings: ModelSettings
    waves: WaveSettings | None
    obstacles: list[Obstacle]
    clearance: float

    @property
    def name(self) -> str:
        """What tells it from any other task."""
        from ...core.obstacles.obstacles import digest

        source = hashlib.sha256()
        for part in self.parts:
            source.update(f"{part.name} {np.round(part.place, 5).tolist()}".encode())
        around = digest(self.obstacles), self.clearance
        return f"{source.hexdigest()[:16]} {self.settings!r} {self.waves!r} {around!r}"


def task_of(model: bpy.types.Object) -> ModelTask:
    """Read what is needed; SceneError if the model cannot be evaluated."""
    check_writable(model)
    group = model.splash_model
    if not group.parts:
        raise SceneError(f"'{model.name}' has no splashes: add one to its list")
    if lost := [part.name for part in group.parts if not part.is_there]:
        raise SceneError(
            f"{', '.join(map(repr, lost))} was deleted: the model stays as it is. Undo, or remove "
            "the splash from its list"
        )
    return ModelTask(
        [read_part(part, model) for part in group.parts if part.show],
        to_settings(group.settings, ModelSettings),
        to_settings(group.waves, WaveSettings) if group.use_waves else None,
        *obstacles_of(model),
    )


def read_part(part: SplashPartGroup, model: bpy.types.Object) -> PartTask:
    """Read a splash of ``model``; SceneError if it has no liquid."""
    splash = part.splash
    # An empty name is that of a list that was applied: the mesh is what counts from then on.
    applied = None if splash.splash_stack.evaluated else mesh_object.read_mesh(splash.data)
    place = model_parts.place_in(model, splash)
    return PartTask(splash.name, refine.read_task(splash), place, applied)


composer: Composer | None = None
"""The last model's, with what it kept."""

_finished: dict[str, Part] = {}
"""The refined splashes of the last model, by name, each in its own place."""


def compute(task: ModelTask, report: Report) -> Composed:
    """Compose; no bpy here. Raises ValueError with what to do."""
    global composer, _finished
    from ...core.composition.model import Composer

    composer = composer or Composer()
    parts, made = [], {}
    for number, part in enumerate(task.parts):
        report(f"Refining {part.label}", 0.3 * number / len(task.parts))
        made[part.name] = _finished.get(part.name) or finish(part)
        own = made[part.name]
        frame = moved(own.placed.frame, part.place, part.label)
        parts.append(replace(own, placed=replace(own.placed, frame=frame)))
    _finished = made
    return composer.compose(
        parts, task.settings, task.waves, task.obstacles, task.clearance,
        lambda stage, share: report(stage, 0.3 + 0.7 * share),
    )  # fmt: skip


def finish(part: PartTask) -> Part:
    """Refine a splash and find its surface."""
    from ...core.composition.model import Part
    from ...core.composition.placement import Placed
    from ...core.mesh.marching_cubes import level_surface
    from ...core.refinement.drop_meshes import DropCloud

    refiner, frame = refine.refiner_of(part.task), part.task.frame
    if part.applied is not None:
        points = frame.points_to_local(part.applied.vertices.astype(np.float64))
        mesh = replace(part.applied, vertices=points.astype(np.float32))
        placed = Placed(refiner.base.liquid, frame, mesh)
        return Part(part.name, placed, DropCloud.empty())
    detail = refiner.liquid(part.steps)
    mesh = level_surface(detail.liquid.level, detail.liquid.velocity, detail.liquid.grid)
    return Part(part.name, Placed(detail.liquid, frame, mesh), detail.cloud)


def moved(frame: Frame, place: np.ndarray, label: str) -> Frame:
    """Return a frame seen from a model. SceneError for a splash that is stretched unevenly."""
    turn = place[:3, :3]
    size = float(np.cbrt(abs(np.linalg.det(turn))))
    if size <= 0 or np.abs(turn @ turn.T / size**2 - np.eye(3)).max() > UNEVEN:
        raise SceneError(f"'{label}' is stretched: give it the same scale along all axes")
    return replace(
        frame,
        axes=frame.axes @ (turn / size).T,
        centre=turn @ frame.centre + place[:3, 3],
        scale=frame.scale / size,
    )


def write(model: bpy.types.Object, task: ModelTask, made: Composed) -> None:
    """Write the joint mesh, and hide the splashes that it stands for."""
    check_writable(model)
    mesh_object.write_mesh(model.data, made.mesh)
    drop_points.write(model, made.drops)
    group = model.splash_model
    group.evaluated = task.name
    group.summary = f"{len(made.mesh.faces):,} faces, {len(task.parts)} splash(es)"
    group.warnings = "\n".join(dict.fromkeys(made.warnings))
    model_parts.settle()


KIND = scheduler.Kind(
    owns=lambda item: item.splash_model.is_model,
    memory=lambda item: item.splash_model,
    task_of=task_of,
    compute=compute,
    write=write,
)


def register() -> None:
    """Have models evaluated."""
    scheduler.add(KIND)


def unregister() -> None:
    """Forget what was kept."""
    global composer
    composer = None
    _finished.clear()
