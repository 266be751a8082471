# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure models on scenes they were never trained on, beside baselines.

    python -m training evaluate DATA --out accuracy.json
    python -m training evaluate DATA --models ours=FILE paper=RUN --twins FILE --pictures FILE.png

``--twins`` takes what ``python -m training ceiling --data DATA --out FILE`` writes.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.condition.voxelize import Condition
from liquid_splash_addon.core.generator.generator import Generator
from liquid_splash_addon.core.generator.precision import PRECISIONS
from liquid_splash_addon.core.generator.weights_file import default_weights_path
from liquid_splash_addon.core.liquid.level_set import surface_level

from ..command_line import command_parser
from ..data.items import Item, choose, load_items
from ..data.samples import held_out_sample
from ..learning.thresholds import Answer
from ..measures.look import look_beside, look_of
from ..measures.metrics import average, occupancy_metrics, relative_divergence, velocity_metrics
from .answers import BASELINES, ByGrid, calibrate, latents_for, load_answers
from .baselines import NearestExample, best_radius, distance_to
from .comparison import draw_comparison
from .diversity import diversity
from .report import Figures, describe, frames_hash, load_kept, load_twins, merged, summary


class Measured(NamedTuple):
    """Figures of each test frame on one grid.

    Attributes
    ----------
    rows : by model, one for each frame
    truth : the truth's own
    strokes : number of strokes of each sketch
    """

    rows: dict[str, list[dict[str, float]]]
    truth: list[dict[str, float]]
    strokes: list[int]


def dilations(condition: Condition) -> dict[str, np.ndarray]:
    """Return each cell's distance to the strokes, and to strokes and patches, in cells."""
    return {
        "dilated_strokes": distance_to(condition.drawn),
        "dilated_spans": distance_to(condition.crossed),
    }


def tuned_radii(validation: Sequence[Item], cells: int) -> dict[str, float]:
    """Return the dilations (cells) with the best IoU on the validation frames."""
    distances: dict[str, list[np.ndarray]] = {}
    truths = []
    for item in validation:
        sample, _ = held_out_sample(item, cells)
        for name, distance in dilations(sample.condition).items():
            distances.setdefault(name, []).append(distance)
        truths.append(sample.distance < 0)
    return {name: best_radius(found, truths) for name, found in distances.items()}


def measure(
    answers: Mapping[str, Answer],
    tests: Sequence[Item],
    nearest: NearestExample,
    radii: Mapping[str, float],
    cells: int,
) -> Measured:
    """Return the figures of the models and the baselines on the test frames.

    A model that cannot answer on this grid is left out, with a printed line.
    """
    left = dict(answers)
    found = Measured({name: [] for name in (*answers, *BASELINES)}, [], [])
    for item in tqdm(tests, desc=f"{cells}^3", unit="frame"):
        sample, strokes = held_out_sample(item, cells)
        truth, spacing = sample.distance < 0, sample.grid.spacing
        near, near_velocity = nearest.answer(strokes, sample.grid)
        guesses: dict[str, tuple[np.ndarray, np.ndarray | None]] = {}
        looks: dict[str, dict[str, float]] = {}
        true_look = look_of(sample.distance, sample.grid)
        for name, answer in list(left.items()):
            try:
                fields = answer.generate(sample.condition, sample.grid)
            except ValueError as error:
                if found.strokes:  # it could, on the first frame
                    raise
                tqdm.write(f"{name} is left out at {cells}^3: {error}")
                del left[name], found.rows[name]
                continue
            guesses[name] = (fields.occupancy > 0.5, fields.velocity)
            looks[name] = look_beside(look_of(surface_level(fields, 0.5), sample.grid), true_look)
        for name, distance in dilations(sample.condition).items():
            guesses[name] = (distance <= radii[name], None)
        guesses["nearest"] = (near < 0, near_velocity)
        for name, (occupied, velocity) in guesses.items():
            row = occupancy_metrics(occupied, truth, spacing)
            if velocity is not None:
                row |= velocity_metrics(velocity, sample.velocity, truth)
                row["divergence"] = relative_divergence(velocity, occupied)
            found.rows[name].append(row | looks.get(name, {}))
        divergence = relative_divergence(sample.velocity, truth)
        found.truth.append({"divergence": divergence, **true_look})
        found.strokes.append(len(strokes))
    return found


def read_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the command line's arguments."""
    parser = command_parser("evaluate", __doc__)
    add, cores = parser.add_argument, os.cpu_count() or 1
    add("data", type=Path, help="directory of the data set")
    add(
        "--models",
        nargs="+",
        metavar="NAME=PATH",
        help="weights or directory of a run; a name may have a run of the paper's for each grid",
    )
    add("--weights", type=Path, default=default_weights_path(), help="short for ours=PATH")
    add("--precision", choices=list(PRECISIONS), default="float32", help="of our weights")
    add("--out", type=Path, help="JSON file for the figures")
    add("--keep", action="store_true", help="keep the rows of other models in it")
    add("--most", type=int, default=100, help="test frames at the most")
    add("--grids", type=int, nargs="+", default=[128, 64])
    add(
        "--examples",
        type=int,
        default=sys.maxsize,
        help="training frames at the most in which the nearest sketch is sought",
    )
    add("--workers", type=int, default=cores, help="processes that trace their sketches")
    add("--twins", type=Path, help="JSON file of the command ceiling with --data")
    add("--seeds", type=int, default=8, help="splashes of one sketch that are compared")
    add("--diverse", type=int, default=16, help="test frames for that at the most; 0: none")
    add("--pictures", type=Path, help="PNG to draw some test frames into")
    add("--shown", type=int, default=6, help="frames in it")
    add("--pixels", type=int, default=240, help="side of a picture in it")
    args = parser.parse_args(arguments)
    if args.seeds < 2 or min(args.most, args.examples, args.shown) < 1:
        parser.error("--seeds must be at least 2, --most, --examples and --shown at least 1")
    args.models = args.models or [f"ours={args.weights}"]
    return args


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    args = read_arguments(arguments)
    try:
        print(run(args))
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


class Frames(NamedTuple):
    """The frames of an evaluation: of the three splits, at most as many as asked for."""

    tests: list[Item]
    validation: list[Item]
    examples: list[Item]


def run(args: argparse.Namespace) -> str:
    """Measure, write what is asked for, and return the tables; ValueError where that fails."""
    tests = choose(load_items(args.data, "test"), args.most)
    validation = choose(load_items(args.data, "validation"), args.most // 3 + 1)
    frames = Frames(tests, validation, choose(load_items(args.data, "train"), args.examples))
    test_hash = frames_hash(tests)
    kept = load_kept(args.out, test_hash) if args.out and args.keep else {}
    twins = load_twins(args.twins, tests) if args.twins else {}
    answers, hashes = load_answers(args.models, args.precision)
    for answer in answers.values():
        calibrate(answer, validation, args.grids)
    results, divergence = measure_grids(args, answers, frames, twins)
    add_diversity(args, answers, tests, twins, results)
    about = {
        **describe_frames(frames, test_hash),
        "models": hashes,
        "truth_divergence": divergence,
        **describe_weights(answers.get("ours")),
    }
    content = merged(kept, {"about": about, **results}, [*answers, *BASELINES])
    if args.out:
        args.out.parent.mkdir(parents=True, exist_ok=True)
        args.out.write_text(json.dumps(content, indent=1) + "\n")
    if args.pictures:
        args.pictures.parent.mkdir(parents=True, exist_ok=True)
        able = {n: a for n, a in answers.items() if any(n in rows for rows in results.values())}
        sheet = draw_comparison(able, choose(tests, args.shown), args.grids, args.pixels)
        sheet.save(args.pictures)
    all_rows = {grid: rows for grid, rows in content.items() if grid != "about"}
    return f"{len(tests)} test frames of {about['test_scenes']} scenes\n\n{describe(all_rows)}"


def measure_grids(
    args: argparse.Namespace,
    answers: Mapping[str, Answer],
    frames: Frames,
    twins: Mapping[Item, float],
) -> tuple[dict[str, Figures], dict[str, float | None]]:
    """Return the figures of models and baselines, and the truth's divergence, by grid."""
    nearest = NearestExample(frames.examples, workers=args.workers)
    results: dict[str, Figures] = {}
    divergence = {}
    for cells in args.grids:
        radii = tuned_radii(frames.validation, cells)
        found = measure(answers, frames.tests, nearest, radii, cells)
        figures = results[str(cells)] = {
            name: summary(rows, frames.tests, found.strokes, twins)
            for name, rows in found.rows.items()
        }
        for name, radius in radii.items():
            figures[name]["radius_cells"] = radius
        for name, answer in answers.items():
            if isinstance(answer, ByGrid) and name in found.rows:
                figures[name]["threshold"] = answer.answers[cells].threshold
        divergence[str(cells)] = average(found.truth).get("divergence")
    return results, divergence


def add_diversity(
    args: argparse.Namespace,
    answers: Mapping[str, Answer],
    tests: Sequence[Item],
    twins: Mapping[Item, float],
    results: dict[str, Figures],
) -> None:
    """Add to ``results`` how much the splashes of one sketch differ by seed."""
    for name, answer in answers.items():
        grids = [cells for cells in args.grids if name in results[str(cells)]]
        if grids and args.diverse:
            latents = latents_for(answer, args.seeds)
            varied = diversity(answer, latents, choose(tests, args.diverse), grids, twins)
            for cells, row in varied.items():
                results[str(cells)][name]["diversity"] = {**row, "seeds": args.seeds}


def describe_frames(frames: Frames, test_hash: str) -> dict[str, Any]:
    """Return what a file of figures says of the frames that they are of."""
    return {
        "test_hash": test_hash,
        "test_frames": len(frames.tests),
        "test_scenes": len({item.scene for item in frames.tests}),
        "validation_frames": len(frames.validation),
        "examples": len(frames.examples),
    }


def describe_weights(ours: Answer | None) -> dict[str, Any]:
    """Return what a file of figures says of our own weights, nothing if they were not measured."""
    if not isinstance(ours, Generator):
        return {}
    return {"weights_hash": ours.weights_hash, "data_hash": ours.header["data_hash"]}
