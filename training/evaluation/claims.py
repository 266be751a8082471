# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure what the paper's figures claim, on the add-on's own path from strokes to splash.

    python -m training claims --out docs/results/claims.json --sheet docs/images/claims.png

With --strokes DIR, recordings of people (.apa, .tilt, ...) are measured and drawn instead.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.spatial.transform import Rotation
from tqdm import tqdm

from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.generator.weights_file import default_weights_path
from liquid_splash_addon.core.grid import LOCAL_SPACING
from liquid_splash_addon.core.sketch.drawing import Drawing

from ..command_line import command_parser
from ..measures.metrics import iou
from ..measures.shapes import (
    coverage,
    halved,
    level_of,
    mean_pair_iou,
    pieces,
    resampled,
    seen_liquid,
    shifted_iou,
    surface_to_volume,
    tunnels,
)
from .bench_sketches import FAST, SLOW, disorderly, flows, growing, recorded_sketches
from .gallery import claims_sheet, recorded_sheet
from .letters import LETTER_REACH, LETTERS, letter_drawings, letter_scores
from .sketch_bench import SketchBench, keeping_to_strokes, liquid, silhouette, stroke_cells, worst

PIECE_CELLS = 32
"""Smallest piece that counts, in cells: a cubic centimetre. Smaller ones are noise of the network,
which answers in blocks of 2^3 cells: with 8, a single speck of 9 cells decided a claim."""

ADDED_NEIGHBOURHOOD = 8 * LOCAL_SPACING
"""Metres around added strokes in which the liquid may change (Fig. 9): eight full cells."""

CLAIM_SEEDS, CLAIM_TURNS = 8, 6
"""Seeds of the claim on variation, turned frames of that on frames."""

BOUNDS: dict[str, tuple[str, float]] = {
    "speed.pieces_ratio": (">", 1.0),
    "speed.surface_to_volume_ratio": (">", 1.0),
    "added.iou_elsewhere": (">", 0.7),
    "letters.read": (">=", 23),
    "disorder.coverage": (">", 0.9),
    "disorder.attached": (">", 0.9),
    "disorder.occupied": ("<", 0.1),
    "disorder.far": ("<", 0.05),
    "variation.coverage": (">", 0.9),
    "variation.repeats": (">=", 1),
    "variation.draft_iou": (">=", 0.7),
    "frames.iou": (">=", 0.6),
}
"""Bounds of the figures.

Where no stroke was added, an IoU of 0.7 is that of a sheet three cells thick with itself after a
step of one cell in any direction, on average half a cell across the sheet: 2.5 / 3.5. Less
would be another splash; thicker liquid keeps more, see moved_by_a_cell.
"""

Figures = dict[str, Any]


def holds(name: str, value: float) -> bool:
    """Tell whether a figure keeps to its bound."""
    sign, bound = BOUNDS[name]
    return {">": value > bound, ">=": value >= bound, "<": value < bound}[sign]


def speed_figures(bench: SketchBench) -> Figures:
    """Return how ruptured slow and fast splashes are (Fig. 7): the slow ones must be more so.

    pieces : of PIECE_CELLS or more; tunnels : holes through the liquid; surface_to_volume :
    1/cm. The ratios are slow over fast, of the sums over all sketches.
    """
    rows: Figures = {}
    for name, drawings in flows().items():
        rows[name] = {}
        for label, speed in (("slow", SLOW), ("fast", FAST)):
            splash = bench.splash(drawings, stroke_speed=speed)
            rows[name][label] = {
                "pieces": len(pieces(liquid(splash), PIECE_CELLS)),
                "tunnels": tunnels(liquid(splash)),
                "surface_to_volume": surface_to_volume(splash.mesh)
                / splash.frame.scale.length
                / 100,
                "occupied": float(liquid(splash).mean()),
            }
    sums = {
        figure: [sum(row[label][figure] for row in rows.values()) for label in ("slow", "fast")]
        for figure in ("pieces", "tunnels", "surface_to_volume")
    }
    ratios = {f"{figure}_ratio": slow / max(fast, 1e-9) for figure, (slow, fast) in sums.items()}
    return {**ratios, "sketches": rows}


def added_figures(bench: SketchBench) -> Figures:
    """Return what adding strokes does to the rest of a splash (Fig. 9), the frame kept.

    iou_elsewhere : least IoU of before and after, farther than ADDED_NEIGHBOURHOOD from the added
    strokes; moved_by_a_cell : the same of the splash with itself, one cell aside.
    """
    rows: Figures = {}
    for name, (first, more) in growing().items():
        before = bench.splash(first)
        old = liquid(before)
        rows[name] = {"moved_by_a_cell": shifted_iou(old)}
        for count in range(1, len(more) + 1):
            after = liquid(bench.splash([*first, *more[:count]], before.frame))
            added = stroke_cells(more[:count], before)
            away = distance_transform_edt(~added) * before.fields.grid.spacing > ADDED_NEIGHBOURHOOD
            rows[name][f"plus_{count}"] = iou(old[away], after[away])
    least = min(row[key] for row in rows.values() for key in row if key.startswith("plus"))
    return {"iou_elsewhere": least, "sketches": rows}


def letter_figures(bench: SketchBench) -> Figures:
    """Return how many letters are read from the outlines of their splashes (Fig. 14).

    With Reach at LETTER_REACH, as a user would set it for letters; unbounded : without.
    """
    return {**read_figures(bench, LETTER_REACH), "unbounded": read_figures(bench, 0.0)}


def read_figures(bench: SketchBench, reach: float) -> Figures:
    """Return how letters are read at a setting of Reach, metres.

    read : of 26. misread : what those not read were taken for. iou : mean of the outlines
    with their own letters in lines of the same area.
    """
    misread, scores = {}, []
    for letter in LETTERS:
        splash = bench.splash(letter_drawings(letter), reach=reach)
        found = letter_scores(silhouette(splash))
        scores.append(found[letter])
        best = max(found, key=lambda name: found[name])
        if best != letter:
            misread[letter] = best
    return {"read": len(LETTERS) - len(misread), "iou": float(np.mean(scores)), "misread": misread}


def disorder_figures(bench: SketchBench) -> Figures:
    """Return how splashes keep to strokes that are no streamlines (Fig. 19), and the worst."""
    rows = {name: keeping_to_strokes(d, bench.splash(d)) for name, d in disorderly().items()}
    return {**worst(rows), "sketches": rows}


def variation_figures(bench: SketchBench) -> Figures:
    """Return what seeds change and what they must not (6.5), on a crown at Variation 1.

    coverage : least share of the stroke cells with liquid, of CLAIM_SEEDS seeds. repeats : 1 if a
    seed gives the same arrays again. seeds_iou : mean over pairs of seeds. draft_iou : of the
    draft with the full result of the same seed, on the draft's grid.
    """
    crown = flows()["crown"]
    splashes = [bench.splash(crown, seed=seed, variation=1.0) for seed in range(CLAIM_SEEDS)]
    drawn = stroke_cells(crown, splashes[0])
    again = bench.splash(crown, seed=0, variation=1.0)
    same = all(
        getattr(again.fields, name).tobytes() == getattr(splashes[0].fields, name).tobytes()
        for name in ("occupancy", "distance", "velocity")
    )
    draft, full = (
        bench.splash(crown, seed=1, variation=1.0, resolution=cells) for cells in ("64", "128")
    )
    return {
        "coverage": min(coverage(liquid(splash), drawn) for splash in splashes),
        "repeats": int(same),
        "seeds_iou": mean_pair_iou([liquid(splash) for splash in splashes]),
        "draft_iou": iou(liquid(draft), halved(level_of(full.fields))),
    }


def frame_figures(bench: SketchBench) -> Figures:
    """Return how alike a crown's splashes are in frames turned about its axis.

    Two of a crown's principal axes are equal, so any turn is as good. iou : mean over pairs of
    CLAIM_TURNS random frames, brought back to the first; resampling : IoU of the splash with itself
    turned there and back, which shows what resampling alone costs.
    """
    crown = flows()["crown"]
    first = bench.splash(crown)
    grid = first.fields.grid
    upright = np.eye(3)[int(np.argmax(np.abs(first.frame.axes[:, 2])))]
    rng = np.random.default_rng(0)
    seen, kept = [liquid(first)], []
    for angle in rng.uniform(0, 2 * np.pi, CLAIM_TURNS - 1):
        frame = first.frame.turned(Rotation.from_rotvec(angle * upright).as_matrix())
        splash = bench.splash(crown, frame)
        seen.append(seen_liquid(splash.fields, frame, first.frame, grid))
        turned = seen_liquid(first.fields, first.frame, frame, grid)
        back = resampled(np.where(turned, -1.0, 1.0), grid, frame, first.frame, grid) < 0
        kept.append(iou(seen[0], back))
    return {
        "iou": mean_pair_iou(seen),
        "resampling": float(np.mean(kept)),
    }


CLAIMS: dict[str, Callable[[SketchBench], Figures]] = {
    "speed": speed_figures,
    "added": added_figures,
    "letters": letter_figures,
    "disorder": disorder_figures,
    "variation": variation_figures,
    "frames": frame_figures,
}
"""The function that measures each claim."""


def recorded_figures(bench: SketchBench, sketches: dict[str, list[Drawing]]) -> Figures:
    """Return how splashes keep to recorded strokes, by sketch, and the worst."""
    rows = {}
    for name, drawings in tqdm(sketches.items(), desc="recordings", leave=False):
        rows[name] = keeping_to_strokes(drawings, bench.fitting_splash(drawings))
    return {**worst(rows), "sketches": rows}


def flat(figures: Figures, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted names and values of nested figures."""
    for name, value in figures.items():
        if isinstance(value, dict) and value:
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def report(figures: Figures) -> list[str]:
    """Return lines: every figure, then the bounded ones and whether they hold."""
    values = dict(flat(figures))
    width = max(map(len, values))
    lines = [
        f"{name:{width}} {value:.3f}" if isinstance(value, float) else f"{name:{width}} {value}"
        for name, value in values.items()
    ]
    for name, (sign, bound) in BOUNDS.items():
        if name in values:
            verdict = "holds" if holds(name, values[name]) else "FAILS"
            lines.append(f"{verdict}: {name} = {values[name]:.3f}, must be {sign} {bound:g}")
    return lines


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("claims", __doc__)
    parser.add_argument("--weights", type=Path, default=default_weights_path())
    parser.add_argument("--cells", type=int, choices=(64, 128), default=128)
    parser.add_argument("--out", type=Path, help="JSON file for the figures")
    parser.add_argument("--sheet", type=Path, help="PNG for the pictures")
    parser.add_argument("--pixels", type=int, default=200, help="side of a picture")
    parser.add_argument("--strokes", type=Path, help="directory of recordings to try instead")
    args = parser.parse_args(arguments)
    try:
        bench = SketchBench(load_generator(args.weights, "CPU"), args.cells)
        sketches = recorded_sketches(args.strokes) if args.strokes else {}
        if args.strokes:
            figures: Figures = {"recorded": recorded_figures(bench, sketches)}
        else:
            measures = tqdm(CLAIMS.items(), desc="claims", leave=False)
            figures = {name: measure(bench) for name, measure in measures}
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    print("\n".join(report(figures)))
    if args.out:
        about = {"weights_hash": bench.generator.weights_hash, "cells": args.cells}
        args.out.parent.mkdir(parents=True, exist_ok=True)
        args.out.write_text(json.dumps({"about": about, **figures}, indent=1) + "\n")
    if args.sheet:
        args.sheet.parent.mkdir(parents=True, exist_ok=True)
        sheet = (
            recorded_sheet(bench, sketches, args.pixels)
            if args.strokes
            else claims_sheet(bench, args.pixels)
        )
        sheet.save(args.sheet)
    return 0
