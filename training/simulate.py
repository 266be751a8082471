# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulate random scenes and keep their representative frames.

    python -m training.simulate --scenes 1000 --out DATA

Scenes that are already in DATA are left alone, so a stopped run goes on where it was.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.fluid.cells import Cells
from liquid_splash_addon.core.fluid.surface import BAND, deepen, particle_distance
from liquid_splash_addon.core.grid import LOCAL_CELLS, LOCAL_SPACING

from .frames import Frame, make_frame, save_scene, scene_path
from .scenes import GAP, Scene, random_scene
from .stepping import Liquid, World, advance, flow, initial_liquid

FIRST, LAST = 0.05, 0.5
"""Seconds after impact between which frames are kept (paper, 4.2.1)."""

EVERY = 0.0125
"""Seconds between the moments looked at."""

NEW = 0.75
"""A frame is kept if the IoU of its cells with those of the last one kept is below this."""

MOST_FRAMES = 12

ENOUGH_INSIDE = 0.7
"""The run stops when less of the liquid than this fits the local box: later frames would be
dropped (see prepare), and spray is expensive."""


def simulate(scene: Scene, jitter_seed: int = 0) -> Iterator[Frame]:
    """Yield the representative frames of ``scene``."""
    world, liquid = World.of(scene), initial_liquid(scene, jitter_seed)
    impact = GAP * scene.spacing / scene.speed
    kept: np.ndarray | None = None
    count = 0
    for time in np.arange(FIRST, LAST + EVERY / 2, EVERY):
        liquid = advance(liquid, world, float(impact + time))
        if share_in_box(liquid, scene) < ENOUGH_INSIDE or count == MOST_FRAMES:
            return
        occupied = np.unique(
            np.ravel_multi_index(tuple(liquid.positions.astype(int).T), (world.cells,) * 3)
        )
        if kept is None or overlap(kept, occupied) < NEW:
            kept, count = occupied, count + 1
            yield take_frame(liquid, world, scene, float(time))


def overlap(first: np.ndarray, second: np.ndarray) -> float:
    """Return the IoU of two sorted arrays of cell numbers."""
    common = len(np.intersect1d(first, second, assume_unique=True))
    return common / (len(first) + len(second) - common)


def share_in_box(liquid: Liquid, scene: Scene) -> float:
    """Return the share of the emitted liquid in a local box along the liquid's own axes."""
    if len(liquid.positions) < 4:
        return 0.0
    offsets = (liquid.positions - liquid.positions.mean(axis=0)) * scene.spacing
    _, axes = np.linalg.eigh(offsets.T @ offsets)
    half = LOCAL_CELLS * LOCAL_SPACING / 2
    return float((np.abs(offsets @ axes) < half).all(axis=1).sum() / liquid.emitted)


def take_frame(liquid: Liquid, world: World, scene: Scene, time: float) -> Frame:
    """Return the liquid as a frame: distance of the particles' surface, projected velocity."""
    margin = int(BAND) + 2
    start = np.floor(liquid.positions.min(axis=0)).astype(int) - margin
    shape = np.ceil(liquid.positions.max(axis=0)).astype(int) + margin - start
    shape += shape % 2
    distance = particle_distance(liquid.positions, tuple(start), tuple(shape))
    deepen(distance)
    cells, _, faces = flow(liquid, world, dt=0.0, layers=margin)
    velocity = np.zeros((*shape, 3), dtype=np.float32)
    within = cells.coordinates - start
    inside = ((within >= 0) & (within < shape)).all(axis=1)
    velocity[tuple(within[inside].T)] = centre_velocity(cells, faces)[inside] * scene.spacing
    return make_frame(distance, velocity, start, time)


def centre_velocity(cells: Cells, faces: np.ndarray) -> np.ndarray:
    """Return the velocity at cell centres ``(cells, 3)``: the mean of opposite faces."""
    above = cells.neighbours[:, [1, 3, 5]]
    upper = faces[np.maximum(above, 0), np.arange(3)]
    return np.asarray(np.where(above >= 0, (faces + upper) / 2, faces))


def run_scene(seed: int, resolution: int, out: Path) -> tuple[int, int]:
    """Simulate one scene into ``out``; return its seed and how many frames it gave."""
    scene = random_scene(seed, resolution)
    frames = list(simulate(scene))
    body = asdict(scene.obstacle)
    parameters = {
        "seed": seed,
        "spacing": scene.spacing,
        "cells": scene.cells,
        "length": scene.length,
        "radius": scene.radius,
        "speed": scene.speed,
        "direction": scene.direction.tolist(),
        "obstacle": {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in body.items()},
        "frames": len(frames),
    }
    save_scene(scene_path(out, seed), parameters, frames)
    return seed, len(frames)


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--scenes", type=int, required=True, help="how many scenes in all")
    parser.add_argument("--out", type=Path, required=True, help="directory of the data set")
    parser.add_argument("--first", type=int, default=0, help="seed of the first scene")
    parser.add_argument(
        "--resolution", type=int, default=LOCAL_CELLS, help="cells along the local box (0.4 m)"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    args = parser.parse_args()
    if args.scenes < 1 or args.workers < 1 or args.resolution < 16:
        parser.error("--scenes and --workers must be at least 1, --resolution at least 16")
    try:
        args.out.mkdir(parents=True, exist_ok=True)
        return run_all(args)
    except OSError as error:
        print(f"{error}: free some space or choose another --out, then run again", file=sys.stderr)
        return 1
    except BrokenProcessPool:
        print("a worker was killed: run the same command again to go on", file=sys.stderr)
        return 1


def run_all(args: argparse.Namespace) -> int:
    """Simulate the scenes that are missing, with a progress bar."""
    seeds = range(args.first, args.first + args.scenes)
    missing = [seed for seed in seeds if not scene_path(args.out, seed).exists()]
    work = partial(run_scene, resolution=args.resolution, out=args.out)
    bar = tqdm(total=len(seeds), initial=len(seeds) - len(missing), unit="scene", smoothing=0.05)
    frames = 0
    # An executor, not a Pool: a Pool waits for ever for the work of a process that was killed.
    with bar, ProcessPoolExecutor(args.workers, get_context("spawn")) as pool:
        for future in as_completed([pool.submit(work, seed) for seed in missing]):
            frames += future.result()[1]
            bar.update()
            rate = (bar.n - bar.initial) / max(bar.format_dict["elapsed"], 1e-9) * 3600
            bar.set_postfix_str(f"{rate:.0f} scenes/hour, {frames} frames")
    return 0


if __name__ == "__main__":
    sys.exit(main())
