# SPDX-License-Identifier: GPL-3.0-or-later
"""How ruptured answers are to sketches of true splashes, drawn slowly and fast (paper, Fig. 7).

    python -m training slow-and-fast DATA

The sketch bench has few sketches, each of one piece; these are many, and some fall into pieces.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.condition.voxelize import voxelize
from liquid_splash_addon.core.generator.patch_classifier import (
    bundled_patch_classifier,
    patch_samples,
)
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import Fields
from liquid_splash_addon.core.liquid.shaping import shaped
from liquid_splash_addon.core.mesh.marching_cubes import surface
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.local_frame import fit_frame
from liquid_splash_addon.core.sketch.strokes import Stroke

from ..command_line import command_parser
from ..data.items import Item
from ..data.samples import held_out_strokes
from ..evaluation.answers import chosen, read_arguments, stroke_counts
from ..evaluation.bench_sketches import FAST, SLOW
from ..evaluation.claims import PIECE_CELLS
from ..learning.thresholds import Answer
from ..measures.metrics import average
from ..measures.shapes import pieces, surface_to_volume, tunnels

Row = dict[str, float]


def drawn_at(strokes: Sequence[Stroke], speed: float) -> list[Stroke]:
    """Return the strokes, all velocities scaled by one factor to a mean of ``speed`` m/s."""
    mean = np.linalg.norm(np.concatenate([s.velocities for s in strokes]), axis=1).mean()
    return [Stroke(s.points, s.velocities * (speed / max(mean, 1e-9))) for s in strokes]


def figures(fields: Fields) -> Row:
    """Return how ruptured liquid is.

    pieces : of PIECE_CELLS or more; holes : through it; surface : of the mesh over its volume,
    1/cm; volume : cells.
    """
    liquid = fields.occupancy > 0.5
    return {
        "pieces": float(len(pieces(liquid, PIECE_CELLS))),
        "holes": float(tunnels(liquid)),
        "surface": surface_to_volume(surface(fields)) / 100 if liquid.any() else np.nan,
        "volume": float(liquid.sum()),
    }


def slow_and_fast(
    answer: Answer, item: Item, cells: int, counts: tuple[int, int]
) -> tuple[Row, Row]:
    """Return the figures of the answers to a frame's sketch at the speeds SLOW and FAST.

    These are speeds of a hand; the liquid is faster by the add-on's default gain. Figures are given
    of what the networks answer, and of that after the add-on has smoothed and broken it up.
    """
    strokes, grid = held_out_strokes(item, item.load(), counts), Grid.local(cells)
    local = fit_frame(strokes).strokes_to_local(strokes)
    settings = SplashSettings()
    slow, fast = (
        answer_figures(answer, drawn_at(local, settings.speed_gain * speed), grid, settings)
        for speed in (SLOW, FAST)
    )
    return slow, fast


def answer_figures(
    answer: Answer, strokes: Sequence[Stroke], grid: Grid, settings: SplashSettings
) -> Row:
    """Return the figures of the answer to strokes in local metres, before and after shaping."""
    patches = patch_samples(strokes, bundled_patch_classifier())
    fields = answer.generate(voxelize(strokes, grid, patches), grid)
    row = figures(fields)
    after = figures(shaped(fields, strokes, settings))
    return row | {f"{name}, broken up": value for name, value in after.items()}


def difference(
    rows: Sequence[tuple[Row, Row]], seeds: Sequence[int], name: str
) -> tuple[float, float]:
    """Return the mean of slow less fast, and its standard error over scenes (``seeds``)."""
    found: dict[int, list[float]] = {}
    for (slow, fast), seed in zip(rows, seeds, strict=True):
        found.setdefault(seed, []).append(slow[name] - fast[name])
    means = np.array([np.mean(differences) for differences in found.values()])
    return float(means.mean()), float(means.std(ddof=1) / np.sqrt(len(means)))


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    args = read_arguments(command_parser("slow-and-fast", __doc__), arguments, most=120)
    try:
        items, answer = chosen(args)
        if len({item.seed for item in items}) < 2:
            raise ValueError("frames of one scene have no standard error: give more of them")
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    bar = tqdm(items, unit="frame", leave=False)
    rows = [slow_and_fast(answer, item, args.cells, stroke_counts(args)) for item in bar]
    slow, fast = (average([row[which] for row in rows]) for which in (0, 1))
    for name in slow:
        apart, spread = difference(rows, [item.seed for item in items], name)
        means = f"slow {slow[name]:.3f} fast {fast[name]:.3f}"
        print(f"{name:18} {means} apart {apart:+.3f} ± {spread:.3f}")
    return 0
