# SPDX-License-Identifier: GPL-3.0-or-later
"""Export a splash or a model to Mantaflow: a domain around it whose first frame is its liquid.

The frame is computed and written to a folder beside the cache in a thread. Then the domain is set,
which deletes what its cache holds, and the files are moved there.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ...core.mantaflow.settings import MantaflowSettings
from ..data.properties import to_settings
from ..scene import fluid_domain
from ..scene.objects import SceneError
from .progress import part_of
from .solver_start import StartTask, compute_start, read_start

if TYPE_CHECKING:
    from ...core.animation.solver_start import SolverStart
    from ...core.mantaflow.cache_files import Timing
    from ...core.mantaflow.domain import Domain
    from ...core.progress import Report

STAGING = "splash_start"
"""Folder in a cache in which a frame is written, until the domain is set."""


@dataclass(frozen=True)
class ExportTask:
    """What an export is made from, as read from the scene.

    Attributes
    ----------
    start : what the liquid is made from
    settings : of the export
    fps : frames per second of the scene
    gravity : the scene's direction, of length 1, or 0 where it has none, ``(3,)``
    weight_limit : largest gravity that Blender's domains know, units/s^2
    cache : folder; cache_path : as Blender is to know it; temporary : whether it will be deleted
    """

    start: StartTask
    settings: MantaflowSettings
    fps: float
    gravity: np.ndarray
    weight_limit: float
    cache: Path
    cache_path: str
    temporary: bool

    @property
    def key(self) -> str:
        """Identifies the task: equal keys, equal results."""
        return f"{self.start.key} {self.settings!r} {self.fps} {self.gravity.tolist()}"


@dataclass(frozen=True)
class Exported:
    """A frame that was written beside the cache.

    Attributes
    ----------
    domain, timing : where and when it is
    staging : folder in which it lies
    gravity : units/s^2 in the liquid's time
    fall : what gravity adds to the velocity in a frame, solver's units
    fastest : cells per frame
    removed : share of the velocity that diverges in thick liquid
    summary, warnings : for the user
    """

    domain: Domain
    timing: Timing
    staging: Path
    gravity: float
    fall: float
    fastest: float
    removed: float
    summary: str
    warnings: list[str]


def settings_for(source: bpy.types.Object, scene: bpy.types.Scene) -> MantaflowSettings:
    """Read the settings of the domain of a splash or model, else those for new ones."""
    domain = fluid_domain.domain_of(source, scene)
    group = scene.splash_mantaflow if domain is None else domain.splash_domain
    settings: MantaflowSettings = to_settings(group.settings, MantaflowSettings)
    return settings


def read_task(
    context: bpy.types.Context, source: bpy.types.Object | None, folder: str
) -> ExportTask:
    """Read what an export needs. Raises SceneError with what stands in the way.

    folder : name of the cache's folder, if it gets a new one
    """
    scene = context.scene
    start = read_start(source)
    assert source is not None
    domain = fluid_domain.domain_of(source, scene)
    if domain is not None:
        fluid_domain.check_usable(domain)
    if not scene.is_editable:
        raise SceneError(f"The scene '{scene.name}' is linked from another file: make it local")
    cache, path, temporary = fluid_domain.new_cache(domain, folder)
    size = float(np.linalg.norm(scene.gravity))
    pull = scene.use_gravity and size > 0
    return ExportTask(
        start, settings_for(source, scene), scene.render.fps / scene.render.fps_base,
        np.array(scene.gravity) / size if pull else np.zeros(3), fluid_domain.MOST_WEIGHT * size,
        cache, path, temporary,
    )  # fmt: skip


def compute(task: ExportTask, report: Report) -> Exported:
    """Write the frame beside the cache, without bpy. Raises ValueError with what to do."""
    return stage(task, compute_start(task.start, part_of(report, 0.0, 0.4)), report)


def stage(task: ExportTask, start: SolverStart, report: Report) -> Exported:
    """Write the frame of a start beside the cache, see :func:`compute`."""
    from ...core.animation.solver_start import in_real_time
    from ...core.mantaflow.cache_files import Timing, write_frame
    from ...core.mantaflow.domain import TIME_UNIT, Domain, check_memory
    from ...core.mantaflow.first_frame import first_frame

    domain = Domain.around(start, task.settings)
    check_memory(domain)
    scale = start.world.scale
    gravity = task.settings.gravity * in_real_time(start.world).scale.gravity
    if np.any(task.gravity) and abs(gravity) > task.weight_limit:
        raise SceneError(
            f"Scale the splash down, or lower Gravity: at {gravity:.0f} units/s² it is more than "
            "Blender's solver takes"
        )
    first = first_frame(start, domain, task.settings, report=part_of(report, 0.4, 0.9))
    report("Writing", 0.9)
    timing = Timing(task.settings.frame, task.fps, scale.time)
    staging = task.cache / STAGING
    size = write_frame(staging, first, timing)
    seconds = scale.time / task.fps
    cells = " x ".join(map(str, domain.shape))
    warnings = list(start.warnings)
    if first.removed > 0.5 and not task.settings.divergence_free:
        warnings.append(
            f"Switch on Divergence-Free: the solver's first step will remove {first.removed:.0%} "
            "of the motion inside"
        )
    return Exported(
        domain, timing, staging, gravity,
        gravity * seconds * TIME_UNIT / domain.cell,
        first.fastest * timing.step,
        first.removed,
        f"{cells} voxels, {len(first.positions):,} particles, {size / 2**20:.1f} MB",
        warnings,
    )  # fmt: skip


def write(context: bpy.types.Context, task: ExportTask, made: Exported, source: Any) -> Any:
    """Set the domain, then move the frame into its cache; return the domain object."""
    from ...core.mantaflow.cache_files import CacheError, cannot_write, drop_later

    item = fluid_domain.ensure(context, source)
    fluid_domain.check_usable(item)
    fluid_domain.shape(item, made.domain)
    warnings = made.warnings + fluid_domain.add_effectors(source)
    fluid_domain.configure(
        context, item, made.domain, task.settings, task.cache_path, made.timing.time_scale,
        made.gravity, made.fastest,
    )  # fmt: skip
    # Blender takes note of the settings, and deletes what it thinks is old.
    context.scene.frame_set(context.scene.frame_current)
    frame = made.timing.frame
    try:
        drop_later(task.cache, frame)
        for folder in ("data", "config"):
            (task.cache / folder).mkdir(parents=True, exist_ok=True)
            for path in (made.staging / folder).iterdir():
                path.replace(task.cache / folder / path.name)
        shutil.rmtree(made.staging, ignore_errors=True)
    except OSError as error:
        raise CacheError(cannot_write(task.cache, error)) from error
    fluid_domain.set_ready(item, frame)
    group = item.splash_domain
    if task.temporary:
        warnings.append(
            "Save the file and export again: the cache is in a temporary folder that Blender "
            "deletes when it quits"
        )
    group.cache, group.frame, group.is_temporary = str(task.cache), frame, task.temporary
    group.state = fluid_domain.state_of(item, context.scene)
    group.made_of = fluid_domain.made_of(source, task.settings)
    group.removed, group.fall = made.removed, made.fall
    group.summary, group.verified = made.summary, ""
    group.warnings = "\n".join(dict.fromkeys(warnings))
    return item


def reason_to_export(item: bpy.types.Object, scene: bpy.types.Scene) -> str:
    """Return why a domain's first frame is not what a bake should go on from; "" if it is."""
    from ...core.mantaflow.cache_files import has_frame

    group, fluid = item.splash_domain, fluid_domain.settings_of(item)
    source = fluid_domain.source_of(item)
    if source is None:
        return "Its splash was deleted"
    if not group.cache:
        return "Nothing was exported yet"
    if fluid_domain.is_copy(item, scene):
        return "This is a copy of a domain and shows its cache: select the splash itself"
    if not has_frame(Path(bpy.path.abspath(fluid.cache_directory)), group.frame):
        return "The cache is not there any more: Blender deletes it when a setting is changed"
    if group.state != fluid_domain.state_of(item, scene):
        return "The domain was changed since"
    if group.made_of != fluid_domain.made_of(source, settings_for(source, scene)):
        return "The splash or its settings were changed since"
    return ""
