# SPDX-License-Identifier: GPL-3.0-or-later
"""How exactly liquid must be placed for an IoU: true splashes against themselves, slightly moved.

    python -m training displaced DATA

Sheets are two cells thick, so parts of a cell cost IoU. Every place is moved by a smooth random
field, so that topology, thickness and extent stay right: what is left is the error of placement.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from tqdm import tqdm

from ..command_line import command_parser
from ..data.items import Item, choose, load_items
from ..data.samples import held_out_sample
from ..measures.metrics import iou

MOVE_SIZES = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
"""Root mean square of the moves along any axis, cells."""

SMOOTHING_WIDTH = 8.0
"""Standard deviation of the Gaussian that smooths the moves, cells: from one stroke to the next, a
sheet is moved as a whole."""


def random_moves(shape: tuple[int, ...], rng: np.random.Generator) -> np.ndarray:
    """Return a smooth random field ``(3, X, Y, Z)`` of root mean square 1 along each axis."""
    noise = [
        gaussian_filter(rng.normal(size=shape).astype(np.float32), SMOOTHING_WIDTH)
        for _ in range(3)
    ]
    return np.stack([field / field.std() for field in noise])


def moved_iou(distance: np.ndarray, moves: np.ndarray) -> float:
    """Return the IoU of what is liquid (``distance`` < 0) with itself, moved by ``moves`` cells."""
    places = np.indices(distance.shape, dtype=np.float32) + moves
    moved = map_coordinates(distance, places, order=1, mode="nearest")
    return iou(moved < 0, distance < 0)


def thickness(distance: np.ndarray) -> float:
    """Return the mean thickness in cells: twice the volume over the surface's area."""
    filled = np.clip(0.5 - distance, 0, 1)
    area = np.sqrt(sum(part**2 for part in np.gradient(filled))).sum()
    return float(2 * filled.sum() / max(area, 1e-9))


def measure(items: Sequence[Item], cells: int, seed: int = 0) -> tuple[float, list[float]]:
    """Return the mean thickness of the frames' liquid, and the mean IoU for each of MOVE_SIZES."""
    rng = np.random.default_rng(seed)
    thick, found = [], []
    for item in tqdm(items, unit="frame", leave=False):
        distance = held_out_sample(item, cells)[0].distance
        moves = random_moves(distance.shape, rng)
        thick.append(thickness(distance))
        found.append([moved_iou(distance, size * moves) for size in MOVE_SIZES])
    return float(np.mean(thick)), np.mean(found, axis=0).tolist()


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("displaced", __doc__)
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--most", type=int, default=40, help="test frames at the most")
    parser.add_argument("--cells", type=int, default=128, help="side of the box")
    args = parser.parse_args(arguments)
    try:
        items = choose(load_items(args.data, "test"), args.most)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    thick, found = measure(items, args.cells)
    print(f"{len(items)} frames of {args.cells}^3 cells, liquid {thick:.2f} cells thick")
    for size, value in zip(MOVE_SIZES, found, strict=True):
        print(f"moved by {size:4.2f} cells: IoU {value:.3f}")
    return 0
