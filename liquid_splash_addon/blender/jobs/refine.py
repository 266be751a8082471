# SPDX-License-Identifier: GPL-3.0-or-later
"""Refine a splash whenever its list of refinements changes, like a stack of modifiers.

It always starts from the liquid that is stored with the mesh, never from the refined mesh. When it
runs, and in which thread: see scheduler.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import bpy

from ...core import compiled_code
from ...core.refinement.viscous import for_liquid
from ..data import stored_liquid
from ..data.frame_text import frame_from_text
from ..data.model import models_of
from ..data.properties import is_splash, plain
from ..data.refinements import steps_of
from ..scene import drop_points, evaluated, mesh_object, motion
from ..scene.objects import SceneError, check_writable
from ..scene.obstacles import obstacles_key, obstacles_of
from . import compile_ahead, looks, scheduler

if TYPE_CHECKING:
    from ...core.composition.drops import Drops
    from ...core.mesh.mesh import Mesh
    from ...core.obstacles.obstacles import Obstacle
    from ...core.progress import Report
    from ...core.refinement.settings import RefinementSettings, WaveSettings
    from ...core.refinement.shader_attributes import Attributes, Look
    from ...core.refinement.stack import Refined, Refiner
    from ...core.sketch.local_frame import Frame


@dataclass(frozen=True)
class Task:
    """All that refining a splash needs, read from the scene.

    Attributes
    ----------
    content, identifier : of the stored liquid, see data.stored_liquid
    steps : refinements, as they are for its liquid
    left_out : sentences about obstacles that cannot be any
    look : what is wanted for shaders
    colours : of its strokes as text; "" for none
    """

    content: bytes
    identifier: str
    threshold: float
    frame: Frame
    steps: list[RefinementSettings]
    obstacles: list[Obstacle]
    clearance: float
    left_out: list[str] = field(default_factory=list)
    look: looks.WantedLook = looks.NOTHING
    colours: str = ""

    @property
    def key(self) -> str:
        """Identifies the task, by the splash's fields and settings: equal keys, equal results."""
        key = self.key_with(self.steps)
        if self.look.attributes:
            key = f"{key} attributes {self.colours if self.look.tints else ''}"
        return f"{key} {self.left_out!r}" if self.left_out else key

    def key_with(self, steps: object) -> str:
        """Return the key that the task would have with other steps."""
        return f"{self.identifier} {self.threshold} {steps!r} {self.around!r}"

    @property
    def around(self) -> tuple[str, float]:
        """Identifies its obstacles and their clearance."""
        return obstacles_key(self.obstacles, self.clearance)


@dataclass(frozen=True)
class Outcome:
    """The result of refining a splash, in the splash's own units."""

    mesh: Mesh
    drops: Drops
    gained: list[float]
    warnings: list[str]
    attributes: Attributes | None = None


def task_of(splash: bpy.types.Object) -> Task:
    """Read what refining ``splash`` needs. Raises SceneError if it cannot be refined."""
    check_writable(splash)
    return read_task(splash)


def read_task(splash: bpy.types.Object) -> Task:
    """Like :func:`task_of`, also where the mesh cannot be replaced now."""
    content, identifier = stored_liquid.read(splash.data)
    if not content or not splash.splash.frame:
        raise SceneError(f"'{splash.name}' has no stored liquid: generate it again")
    return Task(
        content,
        identifier,
        made_threshold(splash),
        frame_from_text(splash.splash.frame),
        for_liquid(steps_of(splash), splash.splash.settings.liquid),
        *obstacles_of(splash),
        look=looks.wanted_look(splash),
        colours=splash.splash_look.colours,
    )


def made_threshold(splash: bpy.types.Object) -> float:
    """Return the threshold that a splash was made with.

    That of its settings waits for Regenerate, as they all do: else undo would change the mesh.
    """
    record = splash.splash
    return float(plain(record.made_threshold) or plain(record.settings.surface_threshold))


def look_of(task: Task) -> Look | None:
    """Return what shaders are to know of the vertices, without bpy."""
    return looks.look_of(task.look, task.colours, len(refiner_of(task).strokes))


refiner: tuple[tuple[str, float, str, float], Refiner] | None = None
"""The refiner of the last splash, with the results of its steps."""


def refiner_of(task: Task) -> Refiner:
    """Return the refiner for a task, without bpy. Raises ValueError for damaged fields."""
    global refiner
    key = (task.identifier, task.threshold, *task.around)
    if refiner is None or refiner[0] != key:
        refiner = key, new_refiner(task, task.content)
    return refiner[1]


def new_refiner(task: Task, content: bytes) -> Refiner:
    """Return a refiner for stored liquid, with all else as in a task."""
    from ...core.refinement.stack import Refiner
    from ...core.refinement.stored_splash import StoredSplash

    obstacles = [obstacle.seen_from(task.frame) for obstacle in task.obstacles]
    stored = StoredSplash.from_bytes(content)
    return Refiner(
        stored.fields, task.threshold, obstacles, task.clearance, stored.applied, stored.flowed,
        stored.strokes, stored.seed,
    )  # fmt: skip


def waves_of(task: Task) -> list[WaveSettings]:
    """Return the waves on the mesh, applied ones first, without bpy."""
    from ...core.refinement.stack import wave_steps

    return [*refiner_of(task).applied_waves, *wave_steps(task.steps)]


def compute(task: Task, report: Report) -> Outcome:
    """Refine, without bpy. Raises ValueError for damaged fields."""
    report = compile_ahead.wait_for(compiled_code.REFINED, report)
    return outcome_of(task, refiner_of(task).refine(task.steps, report, look_of(task)))


def outcome_of(task: Task, refined: Refined) -> Outcome:
    """Return a refined splash in its own units."""
    from ...core.composition.drops import drops_to_drawing, mesh_to_drawing

    return Outcome(
        mesh_to_drawing(refined.mesh, task.frame).with_edges(),
        drops_to_drawing(refined.cloud, task.frame),
        refined.gained,
        refined.warnings,
        refined.attributes,
    )


def write(splash: bpy.types.Object, task: Task, outcome: Outcome) -> None:
    """Write the refined mesh."""
    check_writable(splash)
    lost = mesh_object.replace_mesh(splash, outcome.mesh, attributes=outcome.attributes)
    drop_points.write(splash, outcome.drops)
    motion.apply(splash)
    remember(splash, task.key, outcome.gained, [*task.left_out, *outcome.warnings, *lost])


def remember(splash: bpy.types.Object, key: str, gained: list[float], warnings: list[str]) -> None:
    """Record on ``splash`` what its mesh was made of, and have its models evaluated.

    key : of the task
    gained : change of the volume by each refinement, as a share
    """
    stack = splash.splash_stack
    evaluated.remember(splash, stack, key)
    stack.summary = f"Volume {sum(gained):+.1%}" if gained else ""
    stack.warnings = "\n".join(dict.fromkeys(warnings))
    for model in models_of(splash):
        scheduler.request(model)


def compute_applied(task: Task, report: Report) -> tuple[Outcome, bytes]:
    """Refine, and store what that makes instead of the refinements. Without bpy."""
    from ...core.refinement.stored_splash import StoredSplash

    stored = StoredSplash.from_bytes(task.content)
    applied = refiner_of(task).applied(task.steps)
    content = replace(stored, applied=applied, flowed=None).to_bytes()
    return compute(task, report), content


def write_applied(splash: bpy.types.Object, task: Task, made: tuple[Outcome, bytes]) -> None:
    """Write the refined mesh, store its liquid and empty the list."""
    outcome, content = made
    write(splash, task, outcome)
    stored_liquid.write(splash.data, content)
    with scheduler.held():
        splash.splash_stack.items.clear()
    remember(splash, task_of(splash).key, [], [*task.left_out, *outcome.warnings])


def evaluate(splash: bpy.types.Object) -> None:
    """Refine ``splash`` now. Raises SceneError, and ValueError for damaged fields."""
    scheduler.evaluate(splash, KIND)


KIND = scheduler.Kind(
    owns=is_splash,
    record=lambda item: item.splash_stack,
    task_of=task_of,
    compute=compute,
    write=write,
)


@bpy.app.handlers.persistent
def free(_file: object = None, _unused: object = None) -> None:
    """Drop the last refiner."""
    global refiner
    refiner = None


def register() -> None:
    """Have the scheduler evaluate splashes."""
    scheduler.add(KIND)
    bpy.app.handlers.load_pre.append(free)


def unregister() -> None:
    """Drop what is kept."""
    bpy.app.handlers.load_pre.remove(free)
    free()
