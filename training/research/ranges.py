# SPDX-License-Identifier: GPL-3.0-or-later
"""What strokes a generator is trained on: how fast, how sharply bent, how far apart.

    python -m training ranges DATA

The limits of the add-on's overlay are read off here.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.condition.trained_range import measured
from liquid_splash_addon.core.sketch.local_frame import fit_frame

from ..command_line import command_parser
from ..data.items import choose, load_items
from ..data.samples import held_out_strokes
from ..data.sketching import STROKES_IN_TRAINING

QUANTILES = (0.5, 0.9, 0.99, 0.999)


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("ranges", __doc__)
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--split", default="train", help="of the data set")
    parser.add_argument("--most", type=int, default=200, help="frames at the most")
    args = parser.parse_args(arguments)
    try:
        items = choose(load_items(args.data, args.split), args.most)
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    rows = []
    for item in tqdm(items):
        strokes = held_out_strokes(item, item.load(), STROKES_IN_TRAINING)
        local = fit_frame(strokes).strokes_to_local(strokes)
        rows += [measures for _, measures in measured(local)]
    print("quantile   " + "".join(f"{q:>9}" for q in QUANTILES))
    for name in ("speed", "turning", "spacing"):
        values = np.concatenate([getattr(row, name) for row in rows])
        found = np.quantile(values[np.isfinite(values)], QUANTILES)
        print(f"{name:10} " + "".join(f"{value:9.3f}" for value in found))
    inside = np.concatenate([row.inside for row in rows])
    print(f"inside     {inside.mean():9.4f}")
    return 0
