# SPDX-License-Identifier: GPL-3.0-or-later
"""Print what a data set holds.

python -m training.inspect DATA
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.grid import LOCAL_CELLS

from .dataset import Item, held_out_sample, load_items
from .evaluate import choose

TIME_EDGES = (0.05, 0.1, 0.2, 0.3, 0.51)
"""Seconds after impact that bound the printed ranges."""


def count_frames(data: Path) -> list[str]:
    """Return lines that say how many scenes and frames each split has, and of which times."""
    lines = []
    times: list[float] = []
    for split in ("train", "validation", "test"):
        items = load_items(data, split)
        times += [item.time for item in items]
        lines.append(f"{split}: {len({i.scene for i in items})} scenes, {len(items)} frames")
    counts, _ = np.histogram(times, TIME_EDGES)
    for low, high, count in zip(TIME_EDGES[:-1], TIME_EDGES[1:], counts, strict=True):
        lines.append(f"{low:.2f}-{high:.2f} s after impact: {count / len(times):.0%} of the frames")
    return lines


def measure(items: Sequence[Item]) -> list[str]:
    """Return lines with the local box's occupancy and the sketches' density."""
    occupied, drawn, strokes = [], [], []
    for item in tqdm(items, leave=False):
        sample, sketch = held_out_sample(item, LOCAL_CELLS)
        occupied.append((sample.distance < 0).mean())
        drawn.append(sample.condition[0].sum() / max((sample.distance < 0).sum(), 1))
        strokes.append(len(sketch))
    low, middle, high = np.quantile(occupied, (0.05, 0.5, 0.95))
    return [
        f"occupied share of the local box, {len(items)} frames: mean {np.mean(occupied):.2%}, "
        f"median {middle:.2%}, 5 % to 95 %: {low:.2%} to {high:.2%}",
        f"sketch density: {np.mean(drawn):.3f} stroke cells a liquid cell, "
        f"{np.mean(strokes):.1f} strokes a sketch",
    ]


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--most", type=int, default=60, help="frames measured at the most")
    args = parser.parse_args()
    try:
        lines = count_frames(args.data)
        lines += measure(choose(load_items(args.data, "train"), args.most))
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
