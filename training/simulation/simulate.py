# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulate random scenes and keep their representative frames.

    python -m training simulate --scenes 1000 --out DATA

Scenes that are already in DATA are left alone, so a stopped run goes on where it was. With
``--split test`` only the scenes of that split are simulated: what an evaluation needs.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.fluid.step import Liquid, Physics, World, advance
from liquid_splash_addon.core.grid import LOCAL_CELLS, LOCAL_SPACING, Grid
from liquid_splash_addon.core.sketch.local_frame import fit_frame

from ..command_line import command_parser
from ..data.frames import StoredFrame, pack_scene, scene_path, write_whole
from ..data.items import SPLITS, split_of
from ..data.sketching import FEWEST_LINES, STROKES_IN_TESTS, draw_strokes, trace_frame
from ..scenes.families import FAMILIES, random_scene
from ..scenes.scene import Scene
from .scheduling import SchedulingError, run_everywhere
from .snapshot import take_frame

FIRST_LOOK, LAST_LOOK = 0.05, 0.5
"""Seconds after impact between which frames are kept (paper, 4.2.1)."""

SHORTEST_WAIT, WAIT_SHARE = 0.008, 0.1
"""Time between looks: at least so many seconds, and at least this share of the time since impact.
Fast splashes are over soon, slow ones change slowly."""

NEW_FRAME = 0.75
"""A frame is kept if the IoU of its cells with those of the last one kept is below this."""

MOST_FRAMES = 16

LEAST_INSIDE = 0.8
"""Share of the emitted liquid that must lie in the local box of the frame's own strokes."""

GIVE_UP = 0.77
"""A run stops when less of the liquid than this lies in a local box along its own axes."""


def looks() -> Iterator[float]:
    """Yield the moments, seconds after impact, at which a frame may be taken."""
    time = FIRST_LOOK
    while time <= LAST_LOOK:
        yield time
        time += max(SHORTEST_WAIT, WAIT_SHARE * time)


def moments(scene: Scene, world: World, jitter_seed: int = 0) -> Iterator[tuple[float, Liquid]]:
    """Yield the moments of :func:`looks`, and the liquid at each; ``world`` : of the scene."""
    liquid = scene.liquid(jitter_seed)
    for time in looks():
        liquid = advance(liquid, world, scene.impact + time)
        yield time, liquid


def simulate(
    scene: Scene,
    stored_spacing: float | None = None,
    jitter_seed: int = 0,
    physics: Physics | None = None,
) -> Iterator[StoredFrame]:
    """Yield the representative frames of ``scene``.

    stored_spacing : cell of the frames, metres; None for the simulation's.
    """
    stored_spacing = stored_spacing or scene.spacing
    world = scene.world(physics)
    kept: np.ndarray | None = None
    count = 0
    for time, liquid in moments(scene, world, jitter_seed):
        if count == MOST_FRAMES or share_in_own_box(liquid, scene.spacing) < GIVE_UP:
            return
        occupied = occupied_cells(liquid, scene.spacing / stored_spacing)
        if kept is not None and overlap(kept, occupied) >= NEW_FRAME:
            continue
        frame = take_frame(liquid, world, scene.spacing, stored_spacing, time)
        if share_in_sketch_box(liquid, scene, frame, stored_spacing) >= LEAST_INSIDE:
            kept, count = occupied, count + 1
            yield frame


def occupied_cells(liquid: Liquid, scale: float) -> np.ndarray:
    """Return the sorted numbers of the cells that hold particles.

    scale : cells counted for each cell of the simulation, along an axis
    """
    cells = (liquid.particles.positions * scale).astype(np.int64)
    return np.unique((cells[:, 0] << 40) + (cells[:, 1] << 20) + cells[:, 2])


def overlap(first: np.ndarray, second: np.ndarray) -> float:
    """Return the IoU of two sorted arrays of cell numbers."""
    common = len(np.intersect1d(first, second, assume_unique=True))
    return common / (len(first) + len(second) - common)


def share_in_own_box(liquid: Liquid, spacing: float) -> float:
    """Share of the emitted liquid in a local box along the liquid's own axes."""
    volumes = liquid.particles.volumes
    if len(volumes) < 4:
        return 0.0
    points = liquid.particles.positions * spacing
    offsets = points - np.average(points, axis=0, weights=volumes)
    _, axes = np.linalg.eigh((offsets * volumes[:, None]).T @ offsets)
    inside = (np.abs(offsets @ axes) < LOCAL_CELLS * LOCAL_SPACING / 2).all(axis=1)
    return float(volumes[inside].sum() / liquid.emitted)


def share_in_sketch_box(
    liquid: Liquid, scene: Scene, frame: StoredFrame, stored_spacing: float
) -> float:
    """Share of the emitted liquid in the local box of a sketch of the frame."""
    rng = np.random.default_rng(scene.seed)
    lines = trace_frame(frame, stored_spacing, rng, plain=True)
    if len(lines) < FEWEST_LINES:
        return 0.0
    strokes = draw_strokes(lines, rng, (STROKES_IN_TESTS[1],) * 2, jitter=False)
    points = fit_frame(strokes).points_to_local(liquid.particles.positions * scene.spacing)
    inside = Grid.local().contains(points)
    return float(liquid.particles.volumes[inside].sum() / liquid.emitted)


def simulate_scene(seed: int, resolution: int, store: int, family: str | None = None) -> bytes:
    """Return the file of one scene. resolution, store : cells along the local box."""
    scene = random_scene(seed, resolution, family)
    stored_spacing = LOCAL_SPACING * LOCAL_CELLS / store
    frames = list(simulate(scene, stored_spacing))
    return pack_scene({**scene.parameters(), "stored_spacing": stored_spacing}, frames)


def read_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options; ends the program where they make no sense."""
    parser = command_parser("simulate", __doc__)
    parser.add_argument("--scenes", type=int, required=True, help="how many seeds, all splits")
    parser.add_argument("--out", type=Path, required=True, help="directory of the data set")
    parser.add_argument("--first", type=int, default=0, help="seed of the first scene")
    parser.add_argument(
        "--resolution", type=int, default=LOCAL_CELLS, help="cells along the local box (0.4 m)"
    )
    parser.add_argument(
        "--store", type=int, help="cells along the local box in the frames (as simulated)"
    )
    parser.add_argument("--split", choices=SPLITS, help="scenes of one split only")
    parser.add_argument("--family", choices=list(FAMILIES), help="scenes of one family only")
    parser.add_argument(
        "--workers", type=int, default=os.cpu_count() or 1, help="processes (one a core)"
    )
    parser.add_argument("--scheduler", help="address of a Dask scheduler, tcp://host:port")
    args = parser.parse_args(arguments)
    args.store = args.store or args.resolution
    if args.scenes < 1 or args.workers < 1 or args.first < 0:
        parser.error("--scenes and --workers must be at least 1, --first at least 0")
    if not 16 <= args.store <= args.resolution:
        parser.error("--store must be between 16 and --resolution")
    return args


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    args = read_arguments(arguments)
    try:
        args.out.mkdir(parents=True, exist_ok=True)
        return run_all(args)
    except OSError as error:
        print(f"{error}: free some space or choose another --out, then run again", file=sys.stderr)
    except SchedulingError as error:
        print(error, file=sys.stderr)
    return 1


def run_all(args: argparse.Namespace) -> int:
    """Simulate the scenes that are missing, with a progress bar."""
    for half_written in args.out.glob("scene_*.tmp"):
        half_written.unlink()
    seeds = [
        seed
        for seed in range(args.first, args.first + args.scenes)
        if args.split in (None, split_of(seed))
    ]
    missing = [seed for seed in seeds if not scene_path(args.out, seed).exists()]
    results = run_everywhere(
        simulate_scene,
        missing,
        (args.resolution, args.store, args.family),
        workers=args.workers,
        scheduler=args.scheduler,
    )
    bar = tqdm(total=len(seeds), initial=len(seeds) - len(missing), unit="scene", smoothing=0.05)
    failed = {}
    with bar:
        for seed, content, error in results:
            if content is None:
                failed[seed] = error
            else:
                write_whole(scene_path(args.out, seed), content)
            bar.update()
            rate = (bar.n - bar.initial) / max(bar.format_dict["elapsed"], 1e-9) * 3600
            bar.set_postfix_str(f"{rate:.0f} scenes/hour")
    for seed, error in failed.items():
        print(f"scene {seed} failed: {error}", file=sys.stderr)
    return 1 if failed else 0
