# SPDX-License-Identifier: GPL-3.0-or-later
"""Describe what a data set holds, and draw a sheet of its frames.

python -m training inspect DATA --sheet sheet.png
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.grid import LOCAL_CELLS, LOCAL_SPACING

from ..command_line import command_parser
from ..figures.picture import contact_sheet, draw_liquid
from .frames import load_parameters
from .items import SPLITS, Item, choose, list_items, load_items
from .samples import held_out_sample, held_out_strokes

TIME_EDGES = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.501)
"""Seconds after impact that bound the printed ranges."""

LONGEST_BAR = 40
"""Characters of the longest bar of a histogram."""


def histogram(
    title: str, values: Sequence[float], edges: Sequence[float] | np.ndarray
) -> list[str]:
    """Return a histogram as lines of text: range, share, bar."""
    counts, _ = np.histogram(values, edges)
    longest, total = max(counts.max(initial=0), 1), max(counts.sum(), 1)
    lines = [title]
    for low, high, count in zip(edges[:-1], edges[1:], counts, strict=True):
        bar = "#" * round(LONGEST_BAR * count / longest)
        lines.append(f"  {low:7.3f} to {high:7.3f}  {count / total:5.1%}  {bar}")
    return lines


def describe_scenes(data: Path) -> list[str]:
    """Return lines about scenes and frames: splits, families, times, streamlets, size on disk."""
    lines, items = [], []
    for split in SPLITS:
        part = list_items(data, split)
        items += part
        lines.append(f"{split}: {len({i.scene for i in part})} scenes, {len(part)} frames")
    paths = sorted(data.glob("scene_*.npz"))
    scenes = [load_parameters(path) for path in paths]
    families = Counter(scene["family"] for scene in scenes)
    lines.append("families: " + ", ".join(f"{n} {name}" for name, n in families.most_common()))
    size = sum(path.stat().st_size for path in paths)
    lines.append(f"on disk: {size / 1e6:.0f} MB, {size / len(items) / 1e3:.0f} kB a frame")
    lines += histogram("seconds after impact", [item.time for item in items], TIME_EDGES)
    lines += histogram("frames a scene", [len(s["times"]) for s in scenes], (0, 1, 4, 8, 12, 17))
    first = [scene["streamlets"][0] for scene in scenes]
    edges = np.linspace(0, 0.05, 6)
    lines += histogram("radius of the streamlet, m", [s["radius"] for s in first], edges)
    lines += histogram("its speed, m/s", [s["speed"] for s in first], np.linspace(0, 5, 6))
    return lines


def describe_frames(items: Sequence[Item]) -> list[str]:
    """Return lines about occupancy, spray and sketches of some frames."""
    rows: list[dict[str, float]] = []
    for item in tqdm(items, leave=False):
        sample, sketch = held_out_sample(item, LOCAL_CELLS)
        stored = item.load()
        liquid = int((sample.distance < 0).sum())
        spray = (4 / 3 * np.pi * stored.droplets[:, 6].astype(float) ** 3).sum()
        steps = [np.linalg.norm(np.diff(s.points, axis=0), axis=1).sum() for s in sketch]
        rows.append(
            {
                "occupied": liquid / sample.distance.size,
                "drawn": float(sample.condition.drawn.sum()),
                "density": float(sample.condition.drawn.sum()) / max(liquid, 1),
                "strokes": len(sketch),
                "length": float(np.mean(steps)),
                "droplets": len(stored.droplets),
                "spray": spray / max((stored.distance < 0).sum() * item.spacing**3, 1e-12),
            }
        )
    mean = {key: float(np.mean([row[key] for row in rows])) for key in rows[0]}
    shares = [100 * row["occupied"] for row in rows]
    low, middle, high = np.quantile(shares, (0.05, 0.5, 0.95))
    return [
        f"occupied share of the local box, {len(rows)} frames: mean {np.mean(shares):.2f} %, "
        f"median {middle:.2f} %, 5 % to 95 %: {low:.2f} to {high:.2f} %",
        f"sketches: {mean['strokes']:.1f} strokes of {100 * mean['length']:.1f} cm in the mean, "
        f"{mean['drawn']:.0f} stroke cells, {mean['density']:.4f} to a liquid cell",
        f"spray: {mean['droplets']:.0f} droplets a frame, {mean['spray']:.2%} of the volume",
        *histogram("occupied share, %", shares, (0, 0.25, 0.5, 1, 1.5, 2, 3, 5)),
    ]


def draw_item(item: Item, pixels: int) -> Any:
    """Return a picture of one frame, 0.45 m wide, with its solid and a sketch."""
    stored = item.load()
    solid = item.obstacle.scaled(1 / item.spacing).shifted(-stored.start)
    lines = [s.points / item.spacing - stored.start for s in held_out_strokes(item, stored)]
    middle = np.argwhere(stored.distance < 0).mean(axis=0) + 0.5
    width = 1.1 * LOCAL_CELLS * LOCAL_SPACING / item.spacing
    return draw_liquid(stored.signed_distance, pixels, solid, lines, middle, width)


def draw_sheet(items: Sequence[Item], columns: int, pixels: int) -> Any:
    """Return a sheet of pictures of the items, in their order."""
    pictures = [draw_item(item, pixels) for item in tqdm(items, desc="pictures", leave=False)]
    return contact_sheet(pictures, columns)


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("inspect", __doc__)
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--most", type=int, default=60, help="frames measured at the most")
    parser.add_argument("--sheet", type=Path, help="PNG to draw random frames into")
    parser.add_argument("--pictures", type=int, default=24, help="frames on the sheet")
    parser.add_argument("--columns", type=int, default=6)
    parser.add_argument("--pixels", type=int, default=200, help="side of a picture")
    parser.add_argument("--seed", type=int, default=0, help="which frames are drawn")
    args = parser.parse_args(arguments)
    try:
        items = load_items(args.data, "train")
        print("\n".join(describe_scenes(args.data) + describe_frames(choose(items, args.most))))
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    if args.sheet:
        rng = np.random.default_rng(args.seed)
        some = [items[i] for i in rng.permutation(len(items))[: args.pictures]]
        draw_sheet(some, args.columns, args.pixels).save(args.sheet)
    return 0
