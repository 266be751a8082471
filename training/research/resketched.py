# SPDX-License-Identifier: GPL-3.0-or-later
"""Sketch simulated liquid from its mesh, as the add-on does, and generate it again.

python -m training resketched DATA

Beside the IoU with the frame stands that of the strokes that accuracy is measured with: those are
traced in the stored fields. Where strokes pass, the frame's own velocity is known: how far theirs
differ from its part along them is measured too.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.animation.streamline_settings import StreamlineSettings
from liquid_splash_addon.core.animation.streamlines_of_surface import (
    strokes_of_surface,
)
from liquid_splash_addon.core.condition.voxelize import Condition
from liquid_splash_addon.core.generator.generator import Generator
from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.numeric.trilinear import sample_field
from liquid_splash_addon.core.refinement.stack import Refiner
from liquid_splash_addon.core.sketch.drawing import Drawing, tangents
from liquid_splash_addon.core.sketch.local_frame import fit_frame
from liquid_splash_addon.core.sketch.strokes import Stroke

from ..command_line import command_parser
from ..data.items import Item, choose, load_items
from ..data.samples import held_out_sample, samples_on
from ..measures.metrics import average, iou
from .surfaces import true_liquid


def measure(item: Item, generator: Generator, cells: int, strokes: int) -> dict[str, float]:
    """Return the figures of one frame."""
    liquid = true_liquid(item)
    mesh = Refiner(liquid.fields()).refine([]).mesh
    settings = StreamlineSettings(strokes=strokes, seed=item.seed)
    drawings = strokes_of_surface(mesh.vertices, mesh.faces, mesh.velocities, settings)
    sample, usual = held_out_sample(item, cells)
    # The frame's arrays begin after two cells of air, see true_liquid, and at its start.
    shift = (item.load().start - 2) * item.spacing
    found = [
        Stroke(d.points + shift, np.asarray(d.speeds)[:, None] * tangents(d.points))
        for d in drawings
    ]
    frame = fit_frame(found, 0.0)
    (again,) = samples_on(item.load(), item.spacing, found, frame, [Grid.local(cells)])
    return {
        "strokes": float(len(found)),
        "usual_strokes": float(len(usual)),
        "iou": iou(answer(generator, again.condition, again.grid), again.distance < 0),
        "usual_iou": iou(answer(generator, sample.condition, sample.grid), sample.distance < 0),
        "velocity_error": velocity_error(drawings, liquid.velocity, liquid.grid),
    }


def answer(generator: Generator, condition: Condition, grid: Grid) -> np.ndarray:
    """Return where the generator puts liquid, bool ``(X, Y, Z)``."""
    return np.asarray(generator.generate(condition, grid).occupancy > 0.5)


def velocity_error(drawings: Sequence[Drawing], velocity: np.ndarray, grid: Grid) -> float:
    """Return the median relative error of the strokes' speeds against the flow along them."""
    errors = []
    for drawing in drawings:
        flow = sample_field(velocity, grid.to_cells(drawing.points))
        along = (flow * tangents(drawing.points)).sum(axis=1)
        speeds = np.asarray(drawing.speeds)
        moving = np.abs(along) > 0.05 * speeds.max()
        errors.append(np.abs(speeds[moving] / along[moving] - 1))
    return float(np.median(np.concatenate(errors)))


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("resketched", __doc__)
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--most", type=int, default=40, help="test frames at the most")
    parser.add_argument("--cells", type=int, default=64, help="of the generator's grid")
    parser.add_argument("--strokes", type=int, default=12, help="of each sketch at the most")
    parser.add_argument("--out", type=Path, help="JSON file for the figures")
    args = parser.parse_args(arguments)
    try:
        items = choose(load_items(args.data, "test"), args.most)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    generator = load_generator()
    rows = [
        measure(item, generator, args.cells, args.strokes) for item in tqdm(items, unit="frame")
    ]
    figures = {"frames": len(rows), **average(rows)}
    print("\n".join(f"{name:24} {value:.4f}" for name, value in figures.items()))
    if args.out:
        args.out.write_text(json.dumps(figures, indent=1) + "\n")
    return 0
