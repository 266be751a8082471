# SPDX-License-Identifier: GPL-3.0-or-later
"""Flow On: a splash some milliseconds later, stored with it; its refinements stay live on top."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.simulation.settings import FlowOnSettings
from ..data import stored_liquid
from ..data.properties import assign_settings, plain, to_settings
from ..scene.mesh_space import liquid_matrix
from . import compose, refine
from .progress import part_of

if TYPE_CHECKING:
    from ...core.progress import Report
    from ...core.refinement.stack import Refiner
    from ...core.simulation.start import Start

OVERSTEPPED = 0.8
"""Share of the time that goes into the flow; the rest into refining the result."""


@dataclass(frozen=True)
class FlowTask:
    """All that flowing on needs, read from the scene.

    Attributes
    ----------
    task : of the splash's refinements, as it is now
    up : float64 ``(3,)``, the world's in local space
    """

    task: refine.Task
    settings: FlowOnSettings
    up: np.ndarray

    @property
    def key(self) -> tuple[str, str, str]:
        """Identifies the task: equal keys, equal results."""
        return self.task.key, repr(self.settings), repr(np.round(self.up, 5).tolist())


def task_of(splash: bpy.types.Object) -> FlowTask:
    """Read what flowing on needs. Raises SceneError if it cannot be done."""
    task = refine.task_of(splash)
    matrix = np.array(liquid_matrix(splash), dtype=np.float64)
    world = compose.frame_in_model(task.frame, matrix, splash.name)
    up = world.axes @ np.array([0.0, 0.0, 1.0])
    return FlowTask(task, settings_of(splash), up)


def settings_of(splash: bpy.types.Object) -> FlowOnSettings:
    """Return the settings that a splash has."""
    settings: FlowOnSettings = to_settings(splash.splash_stack.flow_on, FlowOnSettings)
    return settings


def made_with(splash: bpy.types.Object) -> str:
    """Return the digest of what flowing on would be done with now; "" if it would do nothing."""
    settings = settings_of(splash)
    if settings.milliseconds == 0:
        return ""
    return f"{settings!r} {plain(splash.splash.settings.surface_threshold)}"


def is_up_to_date(splash: bpy.types.Object) -> bool:
    """Whether the splash is flown on as its settings say."""
    return bool(splash.splash_stack.flowed == made_with(splash))


def compute(work: FlowTask, report: Report) -> tuple[refine.Outcome, bytes]:
    """Flow on and refine, without bpy. Raises ValueError with what to do."""
    from ...core.refinement.stored_splash import Flowed, StoredSplash
    from ...core.simulation.flow_on import flow_on

    stored = replace(StoredSplash.from_bytes(work.task.content), flowed=None)
    settings = work.settings
    if settings.milliseconds > 0:
        refiner = refine.new_refiner(work.task, stored.to_bytes())
        gravity = settings.gravity_strength if settings.gravity else 0.0
        later = flow_on(
            start_of(refiner, work.up), settings.milliseconds,
            part_of(report, 0.0, OVERSTEPPED), gravity,
        )  # fmt: skip
        stored = replace(stored, flowed=Flowed(later, settings.milliseconds))
    content = stored.to_bytes()
    refined = refine.new_refiner(work.task, content).refine(
        work.task.steps, part_of(report, OVERSTEPPED, 1.0), refine.look_of(work.task)
    )
    return refine.outcome_of(work.task, refined), content


def start_of(refiner: Refiner, up: np.ndarray) -> Start:
    """Return a splash before its list of refinements as what flows on."""
    from ...core.obstacles.obstacles import SHEET, SOLID
    from ...core.simulation.start import LooseDrops, MovingObstacle, Start

    bare = refiner.liquid(())
    obstacles = (
        MovingObstacle(
            obstacle.triangles.reshape(1, -1, 3).astype(np.float32),
            np.arange(3 * len(obstacle.triangles), dtype=np.int32).reshape(-1, 3),
            kind=SOLID if obstacle.solid else SHEET,
        )
        for obstacle in refiner.obstacles
    )
    drops = LooseDrops(bare.cloud.positions, bare.cloud.velocities, bare.cloud.radii)
    return Start(bare.liquid, 1.0, up, drops=drops, obstacles=tuple(obstacles))


def write(splash: bpy.types.Object, work: FlowTask, made: tuple[refine.Outcome, bytes]) -> None:
    """Store the liquid and write the refined mesh."""
    outcome, content = made
    stored_liquid.write(splash.data, content)
    refine.write(splash, refine.task_of(splash), outcome)
    flowed = made_with(splash)
    splash.splash_stack.flowed = flowed if work.settings == settings_of(splash) else ""


def reset(splash: bpy.types.Object) -> None:
    """Note that the liquid now stored was not flown on, and is to stay as it is."""
    assign_settings(splash.splash_stack.flow_on, FlowOnSettings())
    splash.splash_stack.flowed = ""
