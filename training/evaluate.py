# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure a generator on scenes it was never trained on, beside two baselines.

python -m training.evaluate DATA --weights FILE --out accuracy.json
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.generator import Generator
from liquid_splash_addon.core.weights import default_weights_path, load_generator

from .baselines import NearestExample, best_radius, stroke_distance
from .dataset import Item, held_out_sample, load_items
from .metrics import average, occupancy_metrics, velocity_metrics

Figures = dict[str, dict[str, float]]


def choose(items: Sequence[Item], most: int) -> list[Item]:
    """Return at most ``most`` of the items, evenly spread (all times and scenes alike)."""
    places = np.linspace(0, len(items) - 1, min(most, len(items))).round().astype(int)
    return [items[i] for i in places]


def tuned_radius(validation: Sequence[Item], cells: int) -> float:
    """Return the dilation (cells) that suits the validation frames best."""
    samples = [held_out_sample(item, cells)[0] for item in validation]
    return best_radius(
        [stroke_distance(s.condition) for s in samples], [s.distance < 0 for s in samples]
    )


def evaluate(
    generator: Generator, tests: Sequence[Item], nearest: NearestExample, radius: float, cells: int
) -> Figures:
    """Return the mean figures of the generator and the baselines over the test frames."""
    rows: dict[str, list[dict[str, float]]] = {"ours": [], "dilated_strokes": [], "nearest": []}
    for item in tqdm(tests, desc=f"{cells}^3", unit="frame"):
        sample, strokes = held_out_sample(item, cells)
        truth, spacing = sample.distance < 0, sample.grid.spacing
        fields = generator.generate(sample.condition, sample.grid)
        near, near_velocity = nearest.answer(strokes, sample.grid)
        guesses = {
            "ours": (fields.occupancy > 0.5, fields.velocity),
            "dilated_strokes": (stroke_distance(sample.condition) <= radius, None),
            "nearest": (near < 0, near_velocity),
        }
        for name, (occupied, velocity) in guesses.items():
            row = occupancy_metrics(occupied, truth, spacing)
            if velocity is not None:
                row |= velocity_metrics(velocity, sample.velocity, truth)
            rows[name].append(row)
    return {name: average(found) for name, found in rows.items()}


def table(results: dict[str, Figures]) -> str:
    """Return the figures as a Markdown table."""
    columns = ("iou", "tpr", "precision", "fpr", "hausdorff_mm", "hd95_mm", "hausdorff_cells",
               "hd95_cells", "velocity_error", "angle_deg")  # fmt: skip
    lines = ["| grid | model | " + " | ".join(columns) + " |", "|---" * (len(columns) + 2) + "|"]
    for cells, figures in results.items():
        for name, row in figures.items():
            values = [
                f"{row[c]:.4f}" if c == "fpr" else f"{row[c]:.3f}" if c in row else "-"
                for c in columns
            ]
            lines.append(f"| {cells}^3 | {name} | " + " | ".join(values) + " |")
    return "\n".join(lines)


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--weights", type=Path, default=default_weights_path())
    parser.add_argument("--out", type=Path, help="JSON file for the figures")
    parser.add_argument("--most", type=int, default=100, help="test frames at the most")
    parser.add_argument("--grids", type=int, nargs="+", default=[128, 64])
    args = parser.parse_args()
    try:
        generator = load_generator(args.weights)
        tests = choose(load_items(args.data, "test"), args.most)
        validation = choose(load_items(args.data, "validation"), args.most // 3 + 1)
        nearest = NearestExample(load_items(args.data, "train"))
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    results: dict[str, Figures] = {}
    for cells in args.grids:
        radius = tuned_radius(validation, cells)
        results[str(cells)] = evaluate(generator, tests, nearest, radius, cells)
        results[str(cells)]["dilated_strokes"]["radius_cells"] = radius
    print(f"{len(tests)} test frames\n{table(results)}")
    if args.out:
        about = {
            "weights_hash": generator.weights_hash,
            "data_hash": generator.header["data_hash"],
            "test_frames": len(tests),
            "validation_frames": len(validation),
        }
        args.out.parent.mkdir(parents=True, exist_ok=True)
        args.out.write_text(json.dumps({"about": about, **results}, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
