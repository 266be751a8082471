# SPDX-License-Identifier: GPL-3.0-or-later
"""How ruptured simulated liquid is, by the speed of its strokes: what Fig. 7 may be learned from.

python -m training.ruptures DATA
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.grid import LOCAL_CELLS

from .dataset import Item, choose, held_out_sample, load_items
from .metrics import average, surface_cells
from .shapes import pieces, tunnels

LEAST = 8
"""Cells of the smallest piece that counts: smaller ones are spray."""

GROUPS = 3


def figures(item: Item) -> dict[str, float]:
    """Return the figures of one frame.

    speed : mean of its strokes', m/s; pieces : of LEAST cells or more; holes : through the
    liquid; surface : share of its cells that have an empty neighbour; time : s after impact.
    """
    sample, strokes = held_out_sample(item, LOCAL_CELLS)
    liquid = sample.distance < 0
    speeds = np.concatenate([np.linalg.norm(s.velocities, axis=1) for s in strokes])
    return {
        "speed": float(speeds.mean()),
        "pieces": float(len(pieces(liquid, LEAST))),
        "holes": float(tunnels(liquid)),
        "surface": len(surface_cells(liquid)) / max(int(liquid.sum()), 1),
        "time": item.time,
    }


def by_speed(rows: Sequence[dict[str, float]], groups: int = GROUPS) -> list[dict[str, float]]:
    """Return the means of each of some equal groups, the slowest first, and their ``frames``."""
    ordered = sorted(rows, key=lambda row: row["speed"])
    parts = np.array_split(np.arange(len(ordered)), groups)
    return [{**average([ordered[i] for i in part]), "frames": len(part)} for part in parts]


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--split", default="test", help="train, validation or test")
    parser.add_argument("--most", type=int, default=170, help="frames at the most")
    args = parser.parse_args()
    try:
        items = choose(load_items(args.data, args.split), args.most)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    print(json.dumps(by_speed([figures(item) for item in tqdm(items, unit="frame")]), indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
