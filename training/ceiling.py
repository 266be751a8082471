# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how far a splash is determined at all: twins that differ only in where particles begin.

    python -m training.ceiling --scenes 24 --out FILE

No generator can agree with one simulation much better than its twin does.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.grid import LOCAL_CELLS

from .families import random_scene
from .frames import Frame
from .metrics import iou
from .scheduling import end_with_parent
from .simulate import simulate
from .stepping import Physics

TIMES = (0.05, 0.075, 0.1, 0.15, 0.2, 0.51)
RADII = (0.0, 0.01, 0.02, 0.03, 0.0501)
"""Bounds of the groups: seconds after impact, metres of the streamlet's radius."""

FIRST_SEED = 900_000
"""Seeds of the scenes: none that a data set uses."""


def frame_iou(first: Frame, second: Frame) -> float:
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


def twins(seed: int, resolution: int, physics: Physics) -> list[dict[str, float | str]]:
    """Return time, radius and IoU of the frames that both twins of a scene keep."""
    scene = random_scene(seed, resolution)
    first = {frame.time: frame for frame in simulate(scene, physics=physics)}
    rows: list[dict[str, float | str]] = []
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


def table(rows: list[dict[str, float | str]]) -> list[str]:
    """Return lines: mean IoU of each group of radius and time, and how many frames it has."""
    time = np.array([float(row["time"]) for row in rows])
    radius = np.array([float(row["radius"]) for row in rows])
    values = np.array([float(row["iou"]) for row in rows])
    lines = [f"mean over {len(rows)} frames: {values.mean():.3f}"]
    for low, high in itertools.pairwise(RADII):
        cells = []
        for start, end in itertools.pairwise(TIMES):
            group = (radius >= low) & (radius < high) & (time >= start) & (time < end)
            mean = f"{values[group].mean():.2f} ({group.sum()})" if group.any() else "-"
            cells.append(f"{start * 1e3:.0f}-{end * 1e3:.0f} ms: {mean}")
        lines.append(f"radius {low * 1e3:.0f}-{high * 1e3:.0f} mm: " + ", ".join(cells))
    return lines


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--scenes", type=int, default=24)
    parser.add_argument("--resolution", type=int, default=LOCAL_CELLS)
    parser.add_argument("--flip", type=float, default=0.0, help="1 is FLIP, 0 APIC")
    parser.add_argument("--no-sheets", action="store_true", help="do not resample sheets")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--out", type=Path, help="JSON file for the single frames")
    args = parser.parse_args()
    physics = Physics(flip=args.flip, sheets=not args.no_sheets)
    work = partial(twins, resolution=args.resolution, physics=physics)
    seeds = range(FIRST_SEED, FIRST_SEED + args.scenes)
    rows: list[dict[str, float | str]] = []
    with ProcessPoolExecutor(
        args.workers, get_context("spawn"), initializer=end_with_parent
    ) as pool:
        for part in tqdm(pool.map(work, seeds), total=len(seeds), unit="scene"):
            rows += part
    if not rows:
        print("no frame was kept by both twins: take more scenes", file=sys.stderr)
        return 1
    if args.out:
        args.out.write_text(json.dumps(rows, indent=1) + "\n")
    print("\n".join(table(rows)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
