# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulations of splashes and models, each in a process of its own, one after another.

:func:`read_order` reads the scene; :func:`simulate` needs no bpy but in Blender's own thread, which
it asks for obstacles frame by frame. What is done is kept whenever it ends: frames are files.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ...core.playback.settings import PlaybackSettings
from ...core.simulation.settings import SimulationSettings
from ..data.model import is_model
from ..data.properties import plain, to_settings
from ..scene import frame_folder, motion_object
from ..scene.moving_obstacles import Moving, Sampler
from ..scene.objects import Handle, SceneError
from ..scene.obstacles import solids
from ..scene.places import shown_matrix
from . import frame_runs, main_thread, memory, refine, solver_start
from .child_process import ChildProcess
from .progress import part_of

if TYPE_CHECKING:
    from ...core.animation.solver_start import SolverStart
    from ...core.playback.playback import Playback
    from ...core.progress import Report
    from ...core.refinement.settings import RefinementSettings
    from ...core.simulation.start import Start

MODULE = ".core.playback.process"
SIMULATION_JOB, PLAYBACK_JOB = "simulation.job", "playback.job"
"""Files in a simulation's folder: what its process is to do."""

TICK = 0.1
"""Seconds between two looks at the process."""

PLAYED_SHARE = 1.5
"""Bytes of the files to play over those of the simulation's own, which are compressed."""

LOST_SHARE = 0.05
"""Share of the liquid from which leaving the domain is worth a warning."""

READING = 0.05
"""Share of a run that goes into reading the scene."""


@dataclass(frozen=True)
class Order:
    """A simulation to be done, as read from the scene.

    Attributes
    ----------
    item : the splash or model
    start : what its liquid is made from
    first : frame of the scene that shows it as it is
    frame_seconds : seconds of the scene from frame to frame
    height : of the ground in the world
    waves : of a model; those of a splash are in its list
    made_of : digest of all that, for the panel
    folder, path : of the frames, as it is stored and as it is
    before : where frames of the same simulation are to be moved from
    """

    item: Handle
    start: solver_start.StartTask
    settings: SimulationSettings
    playback: PlaybackSettings
    first: int
    frame_seconds: float
    height: float
    waves: tuple[RefinementSettings, ...]
    obstacles: tuple[Handle, ...]
    scene: str
    made_of: str
    folder: str
    path: Path
    before: Path | None


@dataclass
class Run:
    """An order that is being done, and what came of it.

    Attributes
    ----------
    played : frames that are ready to play
    error : why it ended too early, a sentence for the user
    """

    order: Order
    played: int = 0
    error: str = ""
    warnings: list[str] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def wanted(self) -> int:
        """Frames that are to be simulated, the first included."""
        return self.order.settings.frames + 1


def read_order(context: bpy.types.Context, item: bpy.types.Object) -> Order:
    """Read what simulating ``item`` needs. Raises SceneError with what to do."""
    if not item.is_editable:
        raise SceneError(f"'{item.name}' is linked from another file: make it local first")
    scene, record = context.scene, item.splash_simulation
    collection = item.splash_obstacles.collection
    folder = frame_folder.folder_for(item)
    before = frame_folder.folder_of(item)
    is_moved = frame_folder.is_temporary(record.folder) and record.folder != folder
    found = () if collection is None else solids(collection, item)
    return Order(
        Handle.of(item),
        solver_start.read_start(item),
        to_settings(record.settings, SimulationSettings),
        to_settings(record.playback, PlaybackSettings),
        record.start,
        scene.render.fps_base / scene.render.fps,
        ground_height(item),
        waves_of_model(item),
        tuple(map(Handle.of, found)),
        scene.name,
        made_of(item, scene),
        folder,
        frame_folder.absolute(item, folder),
        before if is_moved and before is not None and before.is_dir() else None,
    )


def ground_height(item: bpy.types.Object) -> float:
    """Return the height of the ground in the world: that of its object, or the number."""
    record = item.splash_simulation
    if record.ground_object is not None:
        return float(shown_matrix(record.ground_object).translation.z)
    return float(plain(record.settings.ground_height))


def waves_of_model(item: bpy.types.Object) -> tuple[RefinementSettings, ...]:
    """Return the waves on the joined surface of a model; nothing for a splash."""
    from ...core.refinement.settings import WaveSettings

    if not is_model(item) or not item.splash_model.use_waves:
        return ()
    return (to_settings(item.splash_model.waves, WaveSettings),)


def made_of(item: bpy.types.Object, scene: bpy.types.Scene) -> str:
    """Digest what the frames of ``item`` would be made of now, without looking at any mesh.

    Obstacles and places are left out: the panel asks with every redraw.
    """
    record = item.splash_simulation
    liquid = item.splash_model if is_model(item) else item.splash_stack
    settings = to_settings(record.settings, SimulationSettings)
    playback = to_settings(record.playback, PlaybackSettings)
    pace = scene.render.fps / scene.render.fps_base, plain(item.splash_motion.time_scale)
    return f"{liquid.evaluated} {settings!r} {playback!r} {record.start} {pace} " + (
        f"{ground_height(item):.6g}" if settings.ground != "NONE" else ""
    )


def simulate(run: Run, report: Report) -> None:
    """Do a run. Raises SceneError and what core raises, each with a sentence for the user."""
    begun, order = time.perf_counter(), run.order
    reading = part_of(report, 0.0, READING)
    made = solver_start.compute_start(order.start, part_of(reading, 0.0, 0.5))
    run.warnings = list(made.warnings)
    moving = read_obstacles(run, part_of(reading, 0.5, 1.0))
    start = start_of(order, made, moving)
    check_room(order, start)
    if order.before is not None:
        report("Moving the frames beside the file", READING)
        frame_folder.move(order.before, order.path)
    frame_folder.prepare(order.path)
    write_jobs(order, start, playback_of(order, made))
    follow(run, Simulating(order.path / PLAYBACK_JOB), part_of(report, READING, 1.0))
    run.seconds = time.perf_counter() - begun


def simulate_all(runs: Sequence[Run], report: Report) -> None:
    """Do runs one after another, see :func:`frame_runs.do_all`."""
    frame_runs.do_all(simulate, runs, report)


def read_obstacles(run: Run, report: Report) -> list[Moving]:
    """Read the obstacles at every frame, in the world, in Blender's own thread."""
    order = run.order
    if not order.obstacles:
        return []

    def begin() -> Sampler:
        items = [item for item in (handle.find() for handle in order.obstacles) if item]
        return Sampler(bpy.data.scenes[order.scene], items, np.eye(4))

    label = "Reading the obstacles"
    sampler = main_thread.ask(begin, report, label, 0.0)
    try:
        for number in range(run.wanted):
            frame = order.first + number
            main_thread.ask(
                lambda frame=frame: sampler.sample(frame), report, label, number / run.wanted
            )
    finally:
        main_thread.ask_anyway(sampler.end)
    run.warnings += [
        f"'{moving.name}' does not keep its triangles while it moves: it was taken to stand "
        "still. Remove the modifiers that change their number"
        for moving in sampler.moving
        if moving.is_changing
    ]
    return list(sampler.moving)


def start_of(order: Order, made: SolverStart, moving: Sequence[Moving]) -> Start:
    """Return what the solver starts from."""
    from ...core.simulation.start import LooseDrops, MovingObstacle, Start

    world = made.world
    up = world.axes @ np.array([0.0, 0.0, 1.0])
    on_ground = world.points_to_local(np.array([0.0, 0.0, order.height]))
    obstacles = (
        MovingObstacle(
            world.points_to_local(one.stacked().astype(np.float64)).astype(np.float32),
            one.faces,
            one.name,
            one.kind,
        )
        for one in moving
        if one.faces is not None and len(one.faces)
    )
    drops = LooseDrops(*(values[~is_small(order, made)] for values in made.drops[:3]))
    seconds = world.scale.durations_to_local(order.frame_seconds)
    return Start(
        made.liquid, seconds, up, float(on_ground @ up),
        drops, tuple(obstacles),
    )  # fmt: skip


def is_small(order: Order, made: SolverStart) -> np.ndarray:
    """Return which drops are too small for the solver, bool ``(n,)``: they fly beside it."""
    from ...core.playback.flying_drops import LEAST_SOLVED
    from ...core.simulation.domain import cell_of

    least = LEAST_SOLVED * cell_of(made.liquid, order.settings)
    return np.asarray(made.drops.radii < least)


def playback_of(order: Order, made: SolverStart) -> Playback:
    """Return how the frames are shown."""
    from ...core.playback.flying_drops import FlyingDrops, Surroundings
    from ...core.playback.playback import Playback
    from ...core.refinement.settings import DropletSettings

    steps: list[RefinementSettings] = []
    task = order.start.task
    if isinstance(task, refine.Task) and order.playback.droplets:
        steps += [step for step in task.steps if isinstance(step, DropletSettings)]
    if order.playback.waves:
        waves = refine.waves_of(task) if isinstance(task, refine.Task) else order.waves
        steps += waves
    up = made.world.axes @ np.array([0.0, 0.0, 1.0])
    has_ground = order.settings.ground != "NONE"
    height = float(made.world.points_to_local(np.array([0.0, 0.0, order.height])) @ up)
    around = Surroundings(-order.settings.pull * up, up, height if has_ground else -np.inf)
    drops = FlyingDrops.grown(*(values[is_small(order, made)] for values in made.drops[:3]))
    return Playback(made.frame, tuple(steps), around, drops)


def check_room(order: Order, start: Start) -> None:
    """Raise SceneError if memory or disc will hardly do. Raises ValueError as the estimate does."""
    from ...core.simulation.estimate import estimate

    expected = estimate(start, order.settings)
    if expected.memory > memory.total_bytes():
        raise SceneError(
            f"The simulation needs about {expected.memory / 1e9:.1f} GB of memory, more than there "
            "is: lower Resolution or Margin"
        )
    free, needed = frame_folder.free_bytes(order.path), bytes_on_disc(expected)
    if needed / 2 > free:
        raise SceneError(
            f"The frames need about {needed / 1e9:.1f} GB on the disk of {order.path}, where "
            f"{free / 1e9:.1f} GB are free: make room, or lower Frames or Resolution"
        )


def bytes_on_disc(expected: Any) -> float:
    """Return what all files take, those to play included; expected : core's Estimate."""
    return float(expected.disc) * (1 + PLAYED_SHARE)


def write_jobs(order: Order, start: Start, playback: Playback) -> None:
    """Write what the process is to do. Raises OSError."""
    from ...core.playback.process import write_job
    from ...core.simulation import process

    simulation = order.path / SIMULATION_JOB
    process.write_job(simulation, start, order.settings, str(order.path))
    write_job(order.path / PLAYBACK_JOB, order.path, playback, simulation)


class Simulating(ChildProcess):
    """The process of a simulation, and what it last said."""

    def __init__(self, job: Path) -> None:
        """Start it. Raises OSError where that is not possible."""
        self.stage, self.share, self.played = "Starting", 0.0, 0
        self.failed, self.warnings = "", []  # type: str, list[str]
        super().__init__({"module": MODULE, "job": str(job)})

    def hear(self, said: Mapping[str, Any]) -> None:
        """Take note of what a line says."""
        self.stage = said.get("stage", self.stage)
        self.share = said.get("share", self.share)
        self.played = said.get("played", self.played)
        self.failed = said.get("failed", self.failed)
        self.warnings = said.get("warnings", self.warnings)


def follow(run: Run, child: Simulating, report: Report) -> None:
    """Wait for a process; end it if ``report`` raises. Raises SceneError with why it failed."""
    try:
        while not child.is_done:
            run.played = child.played
            report(child.stage, child.share)
            child.wait(TICK)
    finally:
        if not child.is_done:
            child.stop()
        run.played = child.played
    run.warnings += child.warnings
    if child.code != 0:
        said = f"The simulation ended too early ({child.last}): press Resume to go on"
        raise SceneError(child.failed or said)


def show(run: Run) -> None:
    """Have what is done of a run played by the object of its splash, which it gets if need be."""
    order, item = run.order, run.order.item.find()
    if item is None or not item.is_editable or not run.played:
        return
    motion_object.ensure(item)
    motion_object.show(item, order.folder, order.first, run.played)


def write(run: Run) -> None:
    """Record on a splash what came of a run, and show it."""
    from ...core.playback.playback import played
    from ...core.simulation.frames import read_manifest

    order, item = run.order, run.order.item.find()
    if item is None or not item.is_editable:
        return
    record = item.splash_simulation
    there = played(order.path)
    if there:
        run.played = there
        record.folder, record.frames, record.wanted = order.folder, there, run.wanted
        record.made_of, record.is_baked = order.made_of, False
        size = frame_folder.used_bytes(order.path) / 1e6
        took = f" in {run.seconds:.0f} s" if run.seconds else ""
        record.summary = f"{there - 1} of {run.wanted - 1} frames{took}, {size:,.0f} MB"
        run.warnings += [*read_manifest(order.path).get("warnings", ()), *lost_liquid(order.path)]
    record.warnings = "\n".join(dict.fromkeys([*filter(None, [run.error]), *run.warnings]))
    show(run)


def lost_liquid(folder: Path) -> list[str]:
    """Return a warning if much of the liquid has left the domain."""
    from ...core.playback.playback import share_left

    lost = share_left(folder)
    if lost < LOST_SHARE:
        return []
    return [f"{lost:.0%} of the liquid has left the domain: raise Margin to keep more of it"]
