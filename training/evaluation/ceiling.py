# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how far a splash is determined at all: twins differ only in where particles start.

    python -m training ceiling --scenes 24 --out FILE
    python -m training ceiling --data DATA --split test --out FILE

No generator can agree with one simulation much better than its twin does. The first compares two
new simulations of scenes that are in no data set; the second, for the option --twins of the command
evaluate, compares a data set's frames with a twin of each scene, and goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.fluid.step import Physics
from liquid_splash_addon.core.grid import LOCAL_CELLS, Grid
from liquid_splash_addon.core.sketch.local_frame import fit_frame

from ..command_line import command_parser
from ..data.frames import StoredFrame, load_parameters, write_whole
from ..data.items import SPLITS, Item, load_items
from ..data.samples import held_out_strokes, resample
from ..measures.metrics import iou
from ..scenes.families import random_scene
from ..scenes.scene import Scene
from ..simulation.scheduling import end_with_parent
from ..simulation.simulate import moments, simulate
from ..simulation.snapshot import take_frame

Row = dict[str, float | str]

TIME_BOUNDS = (0.05, 0.075, 0.1, 0.15, 0.2, 0.51)
RADIUS_BOUNDS = (0.0, 0.01, 0.02, 0.03, 0.0501)
"""Bounds of the groups: seconds after impact, metres of the streamlet's radius."""

NEW_SCENES = 24
"""How many new scenes are simulated by default."""

FIRST_SEED = 900_000
"""Seed of the first new scene, far beyond those of data sets."""


def frame_iou(first: StoredFrame, second: StoredFrame) -> float:
    """Return the IoU of two frames of twins, on the simulation's grid."""
    low = np.minimum(first.start, second.start)
    high = np.maximum(first.start + first.distance.shape, second.start + second.distance.shape)
    masks = []
    for frame in (first, second):
        mask = np.zeros(high - low, dtype=bool)
        begin = frame.start - low
        part = tuple(slice(b, b + n) for b, n in zip(begin, frame.distance.shape, strict=True))
        mask[part] = frame.distance < 0
        masks.append(mask)
    return iou(*masks)


def twins(seed: int, resolution: int, physics: Physics) -> list[Row]:
    """Return a row for each frame that both twins of the scene ``seed`` keep."""
    scene = random_scene(seed, resolution)
    first = {frame.time: frame for frame in simulate(scene, physics=physics)}
    rows: list[Row] = []
    for frame in simulate(scene, jitter_seed=1, physics=physics):
        if frame.time in first:
            rows.append(
                {
                    "seed": seed,
                    "family": scene.family,
                    "radius": scene.streamlets[0].radius,
                    "time": frame.time,
                    "iou": frame_iou(first[frame.time], frame),
                }
            )
    return rows


def twin_frames(items: Sequence[Item], jitter_seed: int = 1) -> Iterator[tuple[Item, StoredFrame]]:
    """Yield frames of a data set, all of one scene, each with a twin's at the same moment.

    Near-duplicates among the twin's frames count too, as long as there is liquid in the box.
    """
    parameters = load_parameters(items[0].scene)
    scene = Scene.of(parameters)
    world = scene.world()
    wanted = {item.time: item for item in items}
    for time, liquid in moments(scene, world, jitter_seed):
        if not len(liquid.particles.positions):
            break
        if time in wanted:
            item = wanted[time]
            yield item, take_frame(liquid, world, scene.spacing, item.spacing, time)
        if time >= max(wanted):
            break


def stored_twins(items: Sequence[Item], jitter_seed: int = 1) -> list[Row]:
    """Return the IoU of a data set's frames with a twin's at the same moments.

    Both are compared on the local box of the stored frame's own strokes, where models are measured.

    items : frames of one scene
    """
    scene = Scene.of(load_parameters(items[0].scene))
    rows: list[Row] = []
    for item, twin in twin_frames(items, jitter_seed):
        stored = item.load()
        frame = fit_frame(held_out_strokes(item, stored))
        both = [resample(f, item.spacing, frame, Grid.local())[0] < 0 for f in (stored, twin)]
        rows.append(
            {
                "seed": item.seed,
                "number": item.number,
                "family": scene.family,
                "radius": scene.streamlets[0].radius,
                "time": item.time,
                "iou": iou(*both),
            }
        )
    return rows


def work_through(
    function: Callable[[Any], list[Row]], parts: Sequence[Any], workers: int
) -> Iterator[list[Row]]:
    """Yield ``function`` of each part, in order, as ``workers`` processes finish them."""
    with ProcessPoolExecutor(workers, get_context("spawn"), initializer=end_with_parent) as pool:
        yield from tqdm(pool.map(function, parts), total=len(parts), unit="scene")


def measure_data(args: argparse.Namespace) -> list[Row]:
    """Return the rows of a data set's split, including those that are in the file already."""
    scenes: dict[int, list[Item]] = {}
    for item in load_items(args.data, args.split):
        scenes.setdefault(item.seed, []).append(item)
    rows: list[Row] = []
    if args.out and args.out.exists():
        times = {(i.seed, i.number): i.time for items in scenes.values() for i in items}
        rows = [row for row in json.loads(args.out.read_text())
                if times.get((row["seed"], row.get("number"))) == row["time"]]  # fmt: skip
    done = {row["seed"] for row in rows}
    missing = [items for seed, items in scenes.items() if seed not in done][: args.scenes]
    for part in work_through(stored_twins, missing, args.workers):
        rows += part
        if args.out:
            write_whole(args.out, (json.dumps(rows, indent=1) + "\n").encode())
    return rows


def measure_new(args: argparse.Namespace) -> list[Row]:
    """Return the rows of new scenes."""
    physics = Physics(flip=args.flip, sheets=not args.no_sheets)
    work = partial(twins, resolution=args.resolution, physics=physics)
    seeds = range(FIRST_SEED, FIRST_SEED + (args.scenes or NEW_SCENES))
    rows = [row for part in work_through(work, seeds, args.workers) for row in part]
    if rows and args.out:
        args.out.write_text(json.dumps(rows, indent=1) + "\n")
    return rows


def table(rows: list[Row]) -> list[str]:
    """Return lines: mean IoU of each group of radius and time, and how many frames it has."""
    time = np.array([float(row["time"]) for row in rows])
    radius = np.array([float(row["radius"]) for row in rows])
    values = np.array([float(row["iou"]) for row in rows])
    lines = [f"mean over {len(rows)} frames: {values.mean():.3f}"]
    for low, high in itertools.pairwise(RADIUS_BOUNDS):
        cells = []
        for start, end in itertools.pairwise(TIME_BOUNDS):
            group = (radius >= low) & (radius < high) & (time >= start) & (time < end)
            mean = f"{values[group].mean():.2f} ({group.sum()})" if group.any() else "-"
            cells.append(f"{start * 1e3:.0f}-{end * 1e3:.0f} ms: {mean}")
        lines.append(f"radius {low * 1e3:.0f}-{high * 1e3:.0f} mm: " + ", ".join(cells))
    return lines


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("ceiling", __doc__)
    parser.add_argument("--scenes", type=int, help=f"at the most ({NEW_SCENES}; all of DATA)")
    parser.add_argument("--data", type=Path, help="directory of a data set")
    parser.add_argument("--split", choices=SPLITS, default="test", help="part of it")
    parser.add_argument("--resolution", type=int, default=LOCAL_CELLS, help="of new scenes")
    parser.add_argument("--flip", type=float, default=0.0, help="1 is FLIP, 0 APIC; new scenes")
    parser.add_argument(
        "--no-sheets", action="store_true", help="do not resample sheets; new scenes"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--out", type=Path, help="JSON file for the single frames")
    args = parser.parse_args(arguments)
    try:
        rows = measure_data(args) if args.data else measure_new(args)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    if not rows:
        print("no frame was kept by both twins: give more --scenes", file=sys.stderr)
        return 1
    print("\n".join(table(rows)))
    return 0
