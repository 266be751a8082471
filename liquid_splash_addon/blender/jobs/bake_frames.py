# SPDX-License-Identifier: GPL-3.0-or-later
"""A splash for each frame of the timeline: of the settings and the drawing of that frame.

What was made lies where simulated frames do and is played alike, so nothing runs in a render. All
frames are read first, a piece of Blender's own thread each; then they are made one after another.
"""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.playback.settings import BakeSettings
from ...core.sketch.strokes import StrokeError
from ..data.properties import to_settings
from ..scene import frame_folder, mesh_object, motion_object
from ..scene.objects import Handle, SceneError
from . import frame_runs, generate, main_thread
from .moments import Moment, read_moment
from .progress import labelled, part_of

if TYPE_CHECKING:
    from ...core.composition.drops import Drops
    from ...core.mesh.mesh import Mesh
    from ...core.playback.baked import BakedFrames
    from ...core.progress import Report

READING = 0.1
"""Share of a run that goes into reading the scene."""


@dataclass(frozen=True)
class Order:
    """Frames that are to be baked, as read from the scene.

    Attributes
    ----------
    item : the splash
    frames : of the timeline, first to last
    seen_at : frame whose drawing all are made of; None: each of its own
    folder, path : of the files, as it is stored and as it is
    before : where files of the same splash are to be moved from
    """

    item: Handle
    frames: range
    seen_at: int | None
    folder: str
    path: Path
    before: Path | None


@dataclass
class Run:
    """An order that is being done, and what came of it.

    Attributes
    ----------
    played : frames that are ready to play
    made : how many of them were made now: the others were there, or are like others
    faults : why frames have no liquid, by their numbers
    error : why it ended too early, a sentence for the user
    """

    order: Order
    played: int = 0
    made: int = 0
    faults: dict[int, str] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    error: str = ""
    seconds: float = 0.0


def read_order(context: bpy.types.Context, splash: bpy.types.Object) -> Order:
    """Read what baking the frames of ``splash`` needs. Raises SceneError with what to do."""
    if not splash.is_editable:
        raise SceneError(f"'{splash.name}' is linked from another file: make it local first")
    sketch = splash.splash.sketch
    if sketch is None or not sketch.users_scene:
        raise SceneError(f"The sketch of '{splash.name}' was deleted: choose another in Last Run")
    settings = bake_settings(splash)
    frames = frames_wanted(settings, context.scene)
    if not frames:
        raise SceneError("The last frame is before the first: choose a later one")
    folder, before = frame_folder.folder_for(splash), frame_folder.folder_of(splash)
    is_moved = frame_folder.is_temporary(splash.splash_simulation.folder) and (
        splash.splash_simulation.folder != folder
    )
    return Order(
        Handle.of(splash),
        frames,
        context.scene.frame_current if settings.drawings == "CURRENT" else None,
        folder,
        frame_folder.absolute(splash, folder),
        before if is_moved and before is not None and before.is_dir() else None,
    )


def bake_settings(splash: bpy.types.Object) -> BakeSettings:
    """Return which frames of a splash are to be baked."""
    settings: BakeSettings = to_settings(splash.splash_simulation.bake, BakeSettings)
    return settings


def frames_wanted(settings: BakeSettings, scene: bpy.types.Scene) -> range:
    """Return the frames of the timeline that get a splash."""
    if settings.range == "SCENE":
        return range(scene.frame_start, scene.frame_end + 1)
    return range(settings.first, settings.last + 1)


def bake(run: Run, report: Report) -> None:
    """Do a run. Raises SceneError where no frame gives a splash, and what else ends it."""
    from ...core.playback.baked import BakedFrames

    begun, order = time.perf_counter(), run.order
    moments = read_moments(run, part_of(report, 0.0, READING))
    if not any(moments):
        raise SceneError(next(iter(run.faults.values())))
    if order.before is not None:
        report("Moving the frames beside the file", READING)
        frame_folder.move(order.before, order.path)
    frame_folder.prepare(order.path)
    baked = BakedFrames(order.path)
    report = part_of(report, READING, 1.0)
    for number, moment in enumerate(moments):
        frame, total = order.frames[number], len(moments)
        part = part_of(report, number / total, (number + 1) / total)
        part(f"Frame {frame}", 0.0)
        add(run, baked, frame, moment, labelled(part, f"Frame {frame}"))
        run.played, run.made = baked.done, baked.made
        check_room(order, baked, total)
    run.seconds = time.perf_counter() - begun
    if len(run.faults) == len(moments):
        run.played = 0
        raise SceneError(next(iter(run.faults.values())))


def bake_all(runs: Sequence[Run], report: Report) -> None:
    """Do runs one after another, see :func:`frame_runs.do_all`."""
    frame_runs.do_all(bake, runs, report)


def read_moments(run: Run, report: Report) -> list[Moment | None]:
    """Read every frame, in Blender's own thread; None where there is nothing to make."""
    order, moments = run.order, []
    seen = None if order.seen_at is None else ask_moment(run, order.seen_at, None, report, 0.0)
    for number, frame in enumerate(order.frames):
        moments.append(ask_moment(run, frame, seen, report, number / len(order.frames)))
    return moments


def ask_moment(
    run: Run, frame: int, seen: Moment | None, report: Report, share: float
) -> Moment | None:
    """Read one frame; why nothing can be made of it is noted. seen : as for read_moment"""
    try:
        found: Moment = main_thread.ask(
            lambda: read_moment(run.order.item, frame, seen),
            report, f"Reading frame {frame}", share,
        )  # fmt: skip
        return found
    except ValueError as error:
        run.faults[frame] = str(error)
        return None


def add(run: Run, baked: BakedFrames, frame: int, moment: Moment | None, report: Report) -> None:
    """Have the file of a frame made, without liquid where nothing can be made of it."""
    if moment is None:
        baked.add("nothing", nothing)
        return
    try:
        baked.add(moment.key, lambda: made(run, moment, report))
    except ValueError as error:
        run.faults[frame] = str(error)
        baked.add("nothing", nothing)


def made(run: Run, moment: Moment, report: Report) -> tuple[Mesh, Drops | None]:
    """Make the splash of a frame, as the object that plays shows it. Without bpy."""
    result = fitted(moment.request, report)
    told = {without_numbers(text) for text in run.warnings}
    run.warnings += [text for text in result.warnings if without_numbers(text) not in told]
    place, slow = moment.place, np.float32(moment.time_scale)
    mesh = mesh_object.moved_mesh(result.mesh, place)
    mesh = replace(mesh, velocities=mesh.velocities * slow)
    drops = result.drops
    if drops is not None:
        linear = place[:3, :3]
        drops = drops._replace(
            positions=(drops.positions @ linear.T + place[:3, 3]).astype(np.float32),
            velocities=(drops.velocities @ linear.T).astype(np.float32) * slow,
            radii=drops.radii * np.float32(np.cbrt(abs(np.linalg.det(linear)))),
        )
    return mesh, drops


def without_numbers(text: str) -> str:
    """Return a sentence by which it is known: it is said once, not for every frame."""
    return re.sub(r"\d[\d.,]*", "", text)


def fitted(request: generate.Request, report: Report) -> generate.Result:
    """Make a splash in the box of the shown one, or in its own where its strokes have left that."""
    try:
        return generate.compute(request, report)
    except StrokeError:
        if request.frame is None:
            raise
        return generate.compute(replace(request, frame=None), report)


def nothing() -> tuple[Mesh, None]:
    """Return what is shown where there is no liquid: Blender reads no file without a vertex."""
    from ...core.mesh.mesh import Mesh

    point = np.zeros((1, 3), dtype=np.float32)
    return Mesh(point, np.zeros((0, 3), dtype=np.int32), point), None


def check_room(order: Order, baked: BakedFrames, total: int) -> None:
    """Raise SceneError once the disk will hardly do for the frames that are left."""
    needed = frame_folder.used_bytes(order.path) / baked.done * (total - baked.done)
    free = frame_folder.free_bytes(order.path)
    if needed / 2 > free:
        raise SceneError(
            f"The frames need about {needed / 1e9:.1f} GB more on the disk of {order.path}, where "
            f"{free / 1e9:.1f} GB are free: make room, or bake fewer frames"
        )


def show(run: Run) -> None:
    """Have what is done of a run played by the object of its splash, which it gets if need be."""
    order, splash = run.order, run.order.item.find()
    if splash is None or not splash.is_editable or not run.played:
        return
    motion_object.ensure(splash)
    motion_object.show(splash, order.folder, order.frames[0], run.played)


def write(run: Run) -> None:
    """Record on a splash what came of a run, and show it."""
    order, splash = run.order, run.order.item.find()
    if splash is None or not splash.is_editable:
        return
    record = splash.splash_simulation
    if run.played:
        record.folder, record.frames, record.wanted = order.folder, run.played, len(order.frames)
        record.is_baked, record.made_of = True, ""
        size = frame_folder.used_bytes(order.path) / 1e6
        took = f", {run.made} made in {run.seconds:.0f} s" if run.seconds else ""
        record.summary = (
            f"Frames {order.frames[0]} to {order.frames[run.played - 1]}{took}, {size:,.0f} MB"
        )
    said = [run.error, *faults_in_words(run.faults), *run.warnings]
    record.warnings = "\n".join(dict.fromkeys(filter(None, said)))
    show(run)


def faults_in_words(faults: dict[int, str]) -> list[str]:
    """Say why frames have no liquid, each reason once with its frames."""
    frames: dict[str, list[int]] = {}
    for frame, reason in sorted(faults.items()):
        frames.setdefault(reason, []).append(frame)
    return [f"Frames {spans(of)}: {reason}" for reason, of in frames.items()]


def spans(numbers: Sequence[int]) -> str:
    """Write whole numbers, ascending, as in ``1, 3-5``."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    return ", ".join(f"{part[0]}" if len(part) == 1 else f"{part[0]}-{part[-1]}" for part in parts)
