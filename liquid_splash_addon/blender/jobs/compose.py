# SPDX-License-Identifier: GPL-3.0-or-later
"""Join splashes into the mesh of their model whenever it or one of them changes.

It starts from the fields that each splash stores, refined by the splash's own list. When it runs,
and in which thread: see scheduler.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.refinement.settings import RefinementSettings, SheetSettings, WaveSettings
from ...core.refinement.viscous import for_liquid
from ...core.settings import ModelSettings
from ...core.sketch.alignment import is_similarity
from ..data.look import colours_from_text
from ..data.model import SplashPartGroup, is_model
from ..data.properties import to_settings
from ..scene import drop_points, evaluated, mesh_object, model_parts, motion
from ..scene.objects import SceneError, check_writable
from ..scene.obstacles import obstacles_key, obstacles_of
from . import looks, refine, scheduler
from .progress import part_of

if TYPE_CHECKING:
    from ...core.composition.model import Composed, Composer, Part
    from ...core.obstacles.obstacles import Obstacle
    from ...core.progress import Report
    from ...core.sketch.local_frame import Frame

SCALE_TOLERANCE = 1e-3
"""Share by which the scales of a splash may differ along its axes."""


@dataclass(frozen=True)
class PartTask:
    """What a splash contributes to a model, read from the scene.

    Attributes
    ----------
    label : the splash's name
    task : what refines it
    place : transform from the splash's space to the model's, ``(4, 4)``
    """

    label: str
    task: refine.Task
    place: np.ndarray

    @property
    def steps(self) -> list[RefinementSettings]:
        """Its refinements except sheets and waves: the model adds its own after joining."""
        kinds = (SheetSettings, WaveSettings)
        return [step for step in self.task.steps if not isinstance(step, kinds)]

    @property
    def key(self) -> str:
        """Identifies its liquid, wherever it stands."""
        frame = (self.task.frame.axes, self.task.frame.centre, self.task.frame.scale)
        digest = hashlib.sha256(repr(frame).encode())
        return f"{self.task.key_with(self.steps)} {digest.hexdigest()[:16]}"


@dataclass(frozen=True)
class ModelTask:
    """What joining the splashes of a model needs, read from the scene."""

    parts: list[PartTask]
    settings: ModelSettings
    sheets: SheetSettings | None
    waves: WaveSettings | None
    obstacles: list[Obstacle]
    clearance: float
    left_out: list[str]
    attributes: bool = False

    @property
    def key(self) -> str:
        """Identifies the task: equal keys, equal results."""
        source = hashlib.sha256()
        for part in self.parts:
            place = np.round(part.place, 5) + 0.0  # no zero with a sign
            source.update(f"{part.key} {place.tolist()}".encode())
        around = obstacles_key(self.obstacles, self.clearance)
        wanted = f"{self.settings!r} {self.sheets!r} {self.waves!r}"
        found = f"{source.hexdigest()[:16]} {wanted} {around!r}"
        if self.attributes:
            found = f"{found} attributes {[part.task.colours for part in self.parts]}"
        return f"{found} {self.left_out!r}" if self.left_out else found


def task_of(model: bpy.types.Object) -> ModelTask:
    """Read what joining ``model`` needs. Raises SceneError if it cannot be evaluated."""
    check_writable(model)
    return read_task(model)


def read_task(model: bpy.types.Object) -> ModelTask:
    """Like :func:`task_of`, also where the mesh cannot be replaced now."""
    group = model.splash_model
    if not group.parts:
        raise SceneError(f"'{model.name}' has no splashes: add one to its list")
    obstacles, clearance, left_out = obstacles_of(model)
    parts = []
    for part in group.parts:
        if part.show:
            try:
                parts.append(read_part(part, model))
            except SceneError as error:
                left_out.append(f"{error}. Left out")
    if not parts and left_out:
        raise SceneError(left_out[-1].removesuffix(". Left out"))
    sheets = [to_settings(group.sheets, SheetSettings)] if group.use_sheets else []
    waves = [to_settings(group.waves, WaveSettings)] if group.use_waves else []
    return ModelTask(
        parts,
        to_settings(group.settings, ModelSettings),
        next(iter(for_liquid(sheets, liquid_of(model))), None),
        next(iter(for_liquid(waves, liquid_of(model))), None),
        obstacles,
        clearance,
        left_out,
        looks.wanted_look(model).attributes,
    )


def liquid_of(model: bpy.types.Object) -> str:
    """Return the liquid of a model: that of the first of its splashes that is shown."""
    shown = [part.splash for part in model.splash_model.parts if part.show and part.is_there]
    return str(shown[0].splash.settings.liquid) if shown else "WATER"


def read_part(part: SplashPartGroup, model: bpy.types.Object) -> PartTask:
    """Read a splash of ``model``. Raises SceneError if it cannot be joined."""
    splash = part.splash
    if not part.is_there:
        raise SceneError(f"'{part.name}' was deleted: undo that, or remove it from the list")
    place = model_parts.place_in(model, splash)
    colours = splash.splash_look.colours if looks.wanted_look(model).tints else ""
    task = replace(refine.read_task(splash), look=looks.NOTHING, colours=colours)
    frame_in_model(task.frame, place, splash.name)  # says at once if it is stretched
    return PartTask(splash.name, task, place)


composer: Composer | None = None
"""The composer of the last model, with its intermediate results."""

_refined: dict[str, Part] = {}
"""The refined splashes of the last model by their keys, each in its own space."""


def compute(task: ModelTask, report: Report) -> Composed:
    """Join the splashes, without bpy. Raises ValueError with what to do."""
    made = the_composer().compose(
        refined_parts(task, report), task.settings, task.waves, task.obstacles, task.clearance,
        part_of(report, 0.3, 1.0), task.sheets, task.attributes,
    )  # fmt: skip
    made.mesh.with_edges()
    return made


def the_composer() -> Composer:
    """Return the composer, with what it keeps of the last model."""
    global composer
    from ...core.composition.model import Composer

    composer = composer or Composer()
    return composer


def refined_parts(task: ModelTask, report: Report) -> list[Part]:
    """Return the refined splashes of a model in its space, without bpy."""
    global _refined
    parts, made = [], {}
    for number, part in enumerate(task.parts):
        report(f"Refining {part.label}", 0.3 * number / len(task.parts))
        refined = made[part.key] = _refined.get(part.key) or refine_part(part)
        frame = frame_in_model(refined.placed.frame, part.place, part.label)
        placed = replace(refined.placed, frame=frame)
        parts.append(replace(refined, placed=placed, colours=colours_of(part, refined)))
    _refined = made
    return parts


def colours_of(part: PartTask, refined: Part) -> np.ndarray | None:
    """Return what the strokes of a splash are to colour; None for nothing."""
    found = colours_from_text(part.task.colours) if part.task.colours else None
    return found if found is not None and len(found) == len(refined.strokes) else None


def refine_part(part: PartTask) -> Part:
    """Refine a splash and find its surface."""
    from ...core.composition.model import refined_part

    return refined_part(part.key, refine.refiner_of(part.task), part.steps, part.task.frame)


def frame_in_model(frame: Frame, place: np.ndarray, label: str) -> Frame:
    """Move a frame to the space of a model. Raises SceneError for a splash that is stretched."""
    if not is_similarity(place, SCALE_TOLERANCE):
        raise SceneError(f"'{label}' is stretched: give it the same scale along all three axes")
    return frame.moved(place)


def write(model: bpy.types.Object, task: ModelTask, made: Composed) -> None:
    """Write the joined mesh, and hide the splashes that it replaces."""
    check_writable(model)
    lost = mesh_object.replace_mesh(model, made.mesh, attributes=made.attributes)
    drop_points.write(model, made.drops)
    motion.apply(model)
    group = model.splash_model
    evaluated.remember(model, group, task.key)
    group.summary = f"{len(made.mesh.faces):,} faces, {len(task.parts)} splash(es)"
    group.warnings = "\n".join(dict.fromkeys([*task.left_out, *made.warnings, *lost]))
    model_parts.update_visibility()


KIND = scheduler.Kind(
    owns=is_model,
    record=lambda item: item.splash_model,
    task_of=task_of,
    compute=compute,
    write=write,
)


@bpy.app.handlers.persistent
def free(_file: object = None, _unused: object = None) -> None:
    """Drop the intermediate results of the last model."""
    global composer
    composer = None
    _refined.clear()


def register() -> None:
    """Have the scheduler evaluate models."""
    scheduler.add(KIND)
    bpy.app.handlers.load_pre.append(free)


def unregister() -> None:
    """Drop what is kept."""
    bpy.app.handlers.load_pre.remove(free)
    free()
