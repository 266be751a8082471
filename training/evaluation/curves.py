# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw how runs learned: accuracy on validation frames against time and against samples.

python -m training curves ours=RUN cgan=RUN --cells 128 --out docs/images/curves.png
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..command_line import command_parser

CURVE_AXES = {"minutes": "minutes of training", "samples": "samples seen"}


def read_curve(run: Path) -> list[dict[str, float]]:
    """Return the measurements of a run, in order; ValueError if it has none.

    A run that went on from an older checkpoint repeats some: the last ones count.
    """
    path = run / "curve.jsonl"
    if not path.exists():
        raise ValueError(
            f"{path} is missing: {run} is no run of `python -m training train`, or was not "
            "measured yet"
        )
    looks: list[dict[str, float]] = []
    for line in path.read_text().splitlines():
        look = json.loads(line)
        looks = [earlier for earlier in looks if earlier["steps"] < look["steps"]]
        looks.append(look)
    return looks


def draw(curves: Mapping[str, list[dict[str, float]]], cells: int, out: Path) -> None:
    """Write a picture of two plots; ValueError if a run was not measured on ``cells``^3."""
    import matplotlib.pyplot as plt

    key = f"iou_{cells}"
    figure, plots = plt.subplots(1, 2, figsize=(10, 3.6), sharey=True)
    for name, looks in curves.items():
        if key not in looks[-1]:
            raise ValueError(f"{name} was not measured on {cells}^3 cells: choose another --cells")
        for plot, axis in zip(plots, CURVE_AXES, strict=True):
            plot.plot([x[axis] for x in looks], [x[key] for x in looks], ".-", label=name)
    for plot, label in zip(plots, CURVE_AXES.values(), strict=True):
        plot.set_xlabel(label)
        plot.grid(alpha=0.3)
    plots[0].set_ylabel(f"IoU at {cells}$^3$, validation frames")
    plots[1].legend()  # its curves end at different places, which leaves room
    figure.tight_layout()
    out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, dpi=110)


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("curves", __doc__)
    parser.add_argument(
        "runs", nargs="+", metavar="NAME=RUN", help="a name for each run, and its directory"
    )
    parser.add_argument("--cells", type=int, default=64, help="grid on which they were measured")
    parser.add_argument("--out", type=Path, required=True, help="PNG")
    args = parser.parse_args(arguments)
    try:
        pairs = [run.partition("=") for run in args.runs]
        curves = {name: read_curve(Path(place or name)) for name, _, place in pairs}
        draw(curves, args.cells, args.out)
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0
