# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulations from start to end: frames to a folder, resumed where they were stopped."""

from __future__ import annotations

import hashlib
import json
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..fluid.particles import Particles
from ..fluid.step import Liquid, advance
from ..mesh.mesh import Mesh
from ..progress import Report, silent
from .frames import (
    MANIFEST,
    UNREADABLE,
    frame_path,
    frames_done,
    packed,
    read_manifest,
    unpacked,
    write_frame,
    write_manifest,
    write_saying,
)
from .scene import Scene, prepare
from .settings import SimulationSettings
from .start import Frame, LooseDrops, Start
from .surface import current_of, kept_out, mesh_of, surface_of

SOLVER = 1
"""Of the solver: a greater one makes other frames of the same start."""


def run(
    start: Start, settings: SimulationSettings, folder: Path | str, report: Report = silent
) -> int:
    """Simulate frames 0 (the start) to ``settings.frames`` into ``folder``; return their number.

    Frames already there are kept if they were made from the same start and settings (see
    :func:`run_key`; more or fewer frames are no other settings), and the run goes on after the
    last of them, bit for bit as if it had never stopped; else they are deleted first.

    report : called before every frame with "Frame i of n" and the share done; may raise Cancelled,
    which leaves the frames that are done. Raises ValueError (no liquid, domain too large, an
    obstacle that cannot be used) and OSError (disk full, folder read-only), each with a sentence
    for the user.
    """
    folder = Path(folder)
    report("Preparing the simulation", 0.0)
    scene = prepare(start, settings)
    begin_folder(folder, run_key(start, settings), start, settings, scene)
    done, liquid = last_whole(folder, scene)
    frames, longest = settings.frames, start.frame_seconds / settings.least_substeps
    # Surface and file are another thread's: meanwhile the solver makes the next frame.
    with ThreadPoolExecutor(1, "liquid-splash-frames") as keeper:
        waiting: Future[None] | None = None
        try:
            for index in range(done, frames + 1):
                report(f"Frame {index} of {frames}", index / (frames + 1))
                if index:
                    liquid = advance(liquid, scene.world, index * start.frame_seconds, longest)
                if waiting is not None:
                    waiting.result()
                waiting = keeper.submit(keep, folder, index, liquid, scene)
        finally:
            if waiting is not None:
                waiting.result()
    report("Done", 1.0)
    return frames_done(folder)


def run_key(start: Start, settings: SimulationSettings) -> str:
    """Return what differs for another simulation: a hash of start, settings and solver version.

    The number of frames is not part of it.
    """
    chosen = {name: value for name, value in asdict(settings).items() if name != "frames"}
    text = json.dumps([SOLVER, start.key(), chosen], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def begin_folder(
    folder: Path, key: str, start: Start, settings: SimulationSettings, scene: Scene
) -> None:
    """Write the manifest; delete what another simulation has left in the folder."""
    manifest = read_manifest(folder)
    if manifest.get("key") != key:
        clear(folder)
    values: dict[str, Any] = {
        "key": key,
        "frames": settings.frames,
        "frame_seconds": start.frame_seconds,
        "cell": scene.domain.cell,
        "settings": asdict(settings),
        "warnings": list(scene.warnings),
    }
    write_manifest(folder, values)


def clear(folder: Path | str) -> None:
    """Delete the simulation in a folder, and nothing else that is in it. Raises OSError."""
    folder = Path(folder)
    # The manifest first: files without it are no simulation.
    for pattern in (MANIFEST, "frame_*.npz", "particles_*.npz", "*.part"):
        for path in folder.glob(pattern):
            path.unlink(missing_ok=True)


def particles_path(folder: Path, index: int) -> Path:
    """Return where the particles of frame ``index`` are kept."""
    return folder / f"particles_{index:05d}.npz"


def keep(folder: Path, index: int, liquid: Liquid, scene: Scene) -> None:
    """Write a frame, and before it the particles from which the run can go on after it."""
    state = liquid.particles._asdict() | {
        "clock": np.array([liquid.time, liquid.emitted], dtype=np.float64)
    }
    write_saying(particles_path(folder, index), packed(state, 0))
    write_frame(folder, index, frame_of(liquid, scene))
    particles_path(folder, index - 1).unlink(missing_ok=True)


def last_whole(folder: Path, scene: Scene) -> tuple[int, Liquid]:
    """Return the number of the next frame, and the liquid at the last that is done."""
    for index in range(frames_done(folder) - 1, -1, -1):
        try:
            arrays = unpacked(particles_path(folder, index))
            time, emitted = (float(value) for value in arrays.pop("clock"))
            return index + 1, Liquid(Particles(**arrays), time, emitted)
        except UNREADABLE:
            frame_path(folder, index).unlink(missing_ok=True)
    return 0, scene.liquid


def frame_of(liquid: Liquid, scene: Scene) -> Frame:
    """Return what is seen of the liquid, in the splash's local space."""
    domain, solid = scene.domain, scene.world.solid_at(liquid.time)
    left = max(liquid.left / max(liquid.emitted, 1e-9), 0.0)
    if not len(liquid.particles.positions):
        return Frame(Mesh.empty(), LooseDrops.none(), left)
    surface, drops = surface_of(liquid.particles, domain.cells)
    current = current_of(liquid.particles, scene.world, liquid.time)
    mesh = mesh_of(kept_out(surface, solid), solid, current)
    return Frame(
        Mesh(
            domain.to_local(mesh.vertices.astype(np.float64)).astype(np.float32),
            mesh.faces,
            domain.vectors_to_local(mesh.velocities.astype(np.float64)).astype(np.float32),
        ),
        LooseDrops(
            domain.to_local(drops.positions.astype(np.float64)).astype(np.float32),
            domain.vectors_to_local(drops.velocities.astype(np.float64)).astype(np.float32),
            (drops.radii * domain.cell).astype(np.float32),
        ),
        left,
    )
