# SPDX-License-Identifier: GPL-3.0-or-later
"""Trace the streamlines of every frame, from which strokes are drawn, and drop useless frames.

    python -m training.prepare DATA

Writes ``lines_NNNNNN.npz`` beside each scene. Frames of which less than 80 % of the liquid
lies in the local box of their own streamlines get no lines. Files already there are kept.
"""

from __future__ import annotations

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.alignment import fit_frame
from liquid_splash_addon.core.fluid.streamlines import representatives, seed_points, trace
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.strokes import Stroke

from .frames import Frame, load_scene, save_arrays

SEEDS = 160
"""Streamlines traced a frame; every use of it clusters some of them anew."""

LINE_LENGTH = (0.05, 0.4)
"""Range of the length at which a streamline is cut, metres."""

THIN = 4
"""Every so many traced points one is stored: two cells apart."""

LEAST_INSIDE = 0.8
"""Share of the liquid that must lie in the local box."""

FEWEST_LINES = 8


def trace_frame(frame: Frame, spacing: float, rng: np.random.Generator) -> list[np.ndarray]:
    """Return streamlines ``(m, 6)`` of a frame: metres from the box's corner, m/s."""
    distance = frame.distance_cells()
    seeds = seed_points(distance, SEEDS, rng)
    lengths = rng.uniform(*LINE_LENGTH, len(seeds)) / spacing
    lines = []
    for line in trace(distance, frame.dense_velocity(), seeds, lengths):
        thin = np.concatenate([line[:-1:THIN], line[-1:]])
        thin[:, :3] = (thin[:, :3] + frame.start) * spacing
        lines.append(thin.astype(np.float32))
    return lines


def share_inside(frame: Frame, spacing: float, lines: list[np.ndarray]) -> float:
    """Return the share of the frame's liquid in the local box of 20 representative lines."""
    strokes = [Stroke(lines[i][:, :3], lines[i][:, 3:]) for i in representatives(lines, 20)]
    cells = np.argwhere(frame.distance < 0)
    points = (cells + frame.start + 0.5) * spacing
    return float(Grid.local().contains(fit_frame(strokes).points_to_local(points)).mean())


def prepare_scene(path: Path) -> tuple[int, int]:
    """Trace one scene's frames; return how many frames there were and how many were kept."""
    parameters, frames = load_scene(path)
    spacing = parameters["spacing"]
    arrays: dict[str, np.ndarray] = {}
    kept = []
    for number, frame in enumerate(frames):
        rng = np.random.default_rng([parameters["seed"], number])
        lines = trace_frame(frame, spacing, rng)
        if len(lines) < FEWEST_LINES or share_inside(frame, spacing, lines) < LEAST_INSIDE:
            continue
        kept.append(number)
        arrays[f"{number}/lines"] = np.concatenate(lines)
        arrays[f"{number}/sizes"] = np.array([len(line) for line in lines], dtype=np.int32)
    arrays["kept"] = np.array(kept, dtype=np.int32)
    save_arrays(lines_path(path), arrays)
    return len(frames), len(kept)


def lines_path(scene: Path) -> Path:
    """Return where the streamlines of the scene file ``scene`` lie."""
    return scene.with_name(scene.name.replace("scene_", "lines_"))


def load_lines(path: Path) -> dict[int, list[np.ndarray]]:
    """Return the streamlines ``(m, 6)`` of each kept frame of a scene, by frame number."""
    with np.load(path) as data:
        return {
            int(n): np.split(data[f"{n}/lines"], np.cumsum(data[f"{n}/sizes"])[:-1])
            for n in data["kept"]
        }


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, help="directory that training.simulate wrote")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    args = parser.parse_args()
    scenes = sorted(args.data.glob("scene_*.npz"))
    if not scenes:
        parser.error(f"no scenes in {args.data}: run training.simulate first")
    missing = [path for path in scenes if not lines_path(path).exists()]
    total, kept = 0, 0
    with ProcessPoolExecutor(args.workers, get_context("spawn")) as pool:
        work = as_completed([pool.submit(prepare_scene, path) for path in missing])
        bar = tqdm(work, total=len(missing), unit="scene")
        for future in bar:
            frames, some = future.result()
            total, kept = total + frames, kept + some
            bar.set_postfix_str(f"kept {kept} of {total} frames")
    return 0


if __name__ == "__main__":
    sys.exit(main())
