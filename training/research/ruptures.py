# SPDX-License-Identifier: GPL-3.0-or-later
"""How ruptured simulated liquid is, by the speed of its strokes: what Fig. 7 can be learned from.

python -m training ruptures DATA
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.grid import LOCAL_CELLS

from ..command_line import command_parser
from ..data.items import Item, choose, load_items
from ..data.samples import held_out_sample
from ..measures.metrics import average, surface_cells
from ..measures.shapes import pieces, tunnels

SMALLEST_PIECE = 8
"""Cells of the smallest piece that counts: smaller ones are spray."""

SPEED_GROUPS = 3

COUNTS = ("pieces", "holes")
"""Figures that are numbers of things."""

BOOTSTRAP_DRAWS = 200


def figures(item: Item) -> dict[str, float]:
    """Return the figures of one frame.

    speed : mean of its strokes', m/s; size : root mean square of their distance from their centre,
    m; pieces : of SMALLEST_PIECE cells or more; holes : through the liquid; surface : share of its
    cells that have an empty neighbour; time : s after impact; seed : the scene's.
    """
    sample, strokes = held_out_sample(item, LOCAL_CELLS)
    liquid = sample.distance < 0
    speeds = np.concatenate([np.linalg.norm(s.velocities, axis=1) for s in strokes])
    points = np.concatenate([s.points for s in strokes])
    return {
        "speed": float(speeds.mean()),
        "size": float(np.sqrt(points.var(axis=0).sum())),
        "pieces": float(len(pieces(liquid, SMALLEST_PIECE))),
        "holes": float(tunnels(liquid)),
        "surface": len(surface_cells(liquid)) / max(int(liquid.sum()), 1),
        "time": item.time,
        "seed": item.seed,
    }


def by_speed(
    rows: Sequence[dict[str, float]], groups: int = SPEED_GROUPS
) -> list[dict[str, float]]:
    """Return the means over ``groups`` equal groups, the slowest first, and their ``frames``."""
    ordered = sorted(rows, key=lambda row: row["speed"])
    parts = np.array_split(np.arange(len(ordered)), groups)
    return [{**average([ordered[i] for i in part]), "frames": len(part)} for part in parts]


def slope(rows: Sequence[dict[str, float]], name: str, given: Sequence[str]) -> float:
    """Return by how much a figure rises where the strokes are e times as fast, by least squares.

    name : of the figure; counts enter as log(1 + count). given : names of figures held constant.
    """
    values = np.array([row[name] for row in rows])
    if name in COUNTS:
        values = np.log1p(values)
    known = [np.log([row[key] for row in rows]) for key in ("speed", *given)]
    columns = np.stack([np.ones(len(rows)), *known], axis=1)
    return float(np.linalg.lstsq(columns, values, rcond=None)[0][1])


def slope_and_error(
    rows: Sequence[dict[str, float]], name: str, given: Sequence[str]
) -> tuple[float, float]:
    """Return :func:`slope` and its standard error, by a bootstrap over whole scenes."""
    scenes: dict[float, list[dict[str, float]]] = {}
    for row in rows:
        scenes.setdefault(row["seed"], []).append(row)
    groups, rng = list(scenes.values()), np.random.default_rng(0)
    drawn = [
        slope(
            [row for i in rng.integers(len(groups), size=len(groups)) for row in groups[i]],
            name,
            given,
        )
        for _ in range(BOOTSTRAP_DRAWS)
    ]
    return slope(rows, name, given), float(np.std(drawn))


def slopes(rows: Sequence[dict[str, float]]) -> dict[str, dict[str, tuple[float, float]]]:
    """Return slope and error of each figure, over all sketches and among those of one size."""
    return {
        name: {
            "all": slope_and_error(rows, name, ()),
            "of one size": slope_and_error(rows, name, ("size",)),
        }
        for name in (*COUNTS, "surface")
    }


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("ruptures", __doc__)
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--split", default="test", help="train, validation or test")
    parser.add_argument("--most", type=int, default=170, help="frames at the most")
    args = parser.parse_args(arguments)
    try:
        items = choose(load_items(args.data, args.split), args.most)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    rows = [figures(item) for item in tqdm(items, unit="frame")]
    print(json.dumps({"by speed": by_speed(rows), "slopes": slopes(rows)}, indent=1))
    return 0
