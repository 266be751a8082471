# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how the default refinements change the accuracy (paper, 5.3 and Table 1, last row).

    python -m training refined DATA --out docs/results/refined.json

A mesh occupies the cells whose centres it encloses: that of the splash before refinement and the
refined one, with its free drops and waves.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.generator.weights_file import default_weights_path
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.mesh.signed_distance import winding_on_grid
from liquid_splash_addon.core.refinement.settings import (
    DropletSettings,
    RefinementSettings,
    WaveSettings,
)
from liquid_splash_addon.core.refinement.stack import Refiner

from ..command_line import command_parser
from ..data.items import Item, choose, load_items
from ..data.samples import held_out_sample
from ..evaluation.report import frames_hash
from ..measures.metrics import average, occupancy_metrics

REFINEMENTS: dict[str, Sequence[RefinementSettings]] = {
    "before": (),
    "droplets": (DropletSettings(),),
    "waves": (WaveSettings(),),
    "after": (DropletSettings(), WaveSettings()),
}
"""Lists of refinements by name; the last is the default."""


def enclosed_cells(mesh: Mesh, grid: Grid) -> np.ndarray:
    """Return bool ``(X, Y, Z)``: the cells of ``grid`` whose centres lie inside the mesh."""
    corners = grid.to_cells(mesh.vertices.astype(np.float64)) - 0.5
    return np.asarray(winding_on_grid(corners[mesh.faces], grid.shape) > 0)


def measure(items: Sequence[Item], weights: Path) -> dict[str, list[dict[str, float]]]:
    """Return the figures of each frame at 128^3 by name of the list."""
    generator = load_generator(weights)
    rows: dict[str, list[dict[str, float]]] = {name: [] for name in REFINEMENTS}
    for item in tqdm(items, unit="frame"):
        sample, _ = held_out_sample(item, 128)
        truth = sample.distance < 0
        refiner = Refiner(generator.generate(sample.condition, sample.grid))
        for name, steps in REFINEMENTS.items():
            refined = refiner.refine(steps)
            occupied = enclosed_cells(refined.mesh, sample.grid)
            row = occupancy_metrics(occupied, truth, sample.grid.spacing)
            rows[name].append({**row, "volume": sum(refined.gained)})
    return rows


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("refined", __doc__)
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--weights", type=Path, default=default_weights_path())
    parser.add_argument("--most", type=int, default=40, help="test frames at the most")
    parser.add_argument("--out", type=Path, help="JSON file for the figures")
    args = parser.parse_args(arguments)
    try:
        items = choose(load_items(args.data, "test"), args.most)
        rows = {name: average(found) for name, found in measure(items, args.weights).items()}
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    for name, row in rows.items():
        print(f"{name:10}", *(f"{key} {value:.4f}" for key, value in row.items()))
    about = {"test_hash": frames_hash(items), "test_frames": len(items)}
    if args.out:
        args.out.write_text(json.dumps({"about": about, **rows}, indent=1) + "\n")
    return 0
