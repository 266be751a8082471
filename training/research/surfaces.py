# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh simulated liquid, and measure how well: distance to its surface, faces that cross.

python -m training surfaces DATA
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import AIR
from liquid_splash_addon.core.liquid.level_set import LevelSet
from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.numeric.trilinear import sample_field
from liquid_splash_addon.core.refinement.settings import DropletSettings, WaveSettings
from liquid_splash_addon.core.refinement.stack import Refiner

from ..command_line import command_parser
from ..data.items import Item, choose, load_items
from ..measures.metrics import average


def crossing_faces(mesh: Mesh) -> float:
    """Return the share of the faces that cross another."""
    import pymeshlab  # here: with its libraries loaded first, bpy does not load

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices.astype(np.float64), mesh.faces))
    meshes.compute_selection_by_self_intersections_per_face()
    return float(meshes.current_mesh().selected_face_number() / max(len(mesh.faces), 1))


def true_liquid(item: Item) -> LevelSet:
    """Return the liquid of a stored frame, air around it."""
    frame = item.load()
    distance = np.pad(frame.signed_distance, 2, constant_values=AIR)
    velocity = np.moveaxis(frame.block_velocity, -1, 0)
    for axis in (1, 2, 3):
        velocity = np.repeat(velocity, 2, axis=axis)
    x, y, z = distance.shape
    grid = Grid((x, y, z), item.spacing, (0.0, 0.0, 0.0))
    return LevelSet(distance, np.pad(velocity, ((0, 0), (2, 2), (2, 2), (2, 2))), grid)


def measure(item: Item) -> dict[str, float]:
    """Return the figures of one frame; distances in cells, crossings as shares of the faces."""
    liquid = true_liquid(item)
    refiner = Refiner(liquid.fields())
    mesh = refiner.refine([]).mesh
    distance, grid = liquid.level, liquid.grid
    away = np.abs(sample_field(distance[None], grid.to_cells(mesh.vertices)))
    return {
        "distance": float(away.mean()),
        "distance_95": float(np.quantile(away, 0.95)),
        "crossing": crossing_faces(mesh),
        "crossing_droplets": crossing_faces(refiner.refine([DropletSettings()]).mesh),
        "crossing_waves": crossing_faces(refiner.refine([WaveSettings()]).mesh),
        "crossing_all": crossing_faces(refiner.refine([DropletSettings(), WaveSettings()]).mesh),
    }


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("surfaces", __doc__)
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--most", type=int, default=16, help="test frames at the most")
    parser.add_argument("--out", type=Path, help="JSON file for the figures")
    args = parser.parse_args(arguments)
    try:
        items = choose(load_items(args.data, "test"), args.most)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    rows = [measure(item) for item in tqdm(items, unit="frame")]
    worst = {f"worst_{name}": max(row[name] for row in rows) for name in rows[0]}
    figures = {"frames": len(rows), **average(rows), **worst}
    print("\n".join(f"{name:24} {value:.5f}" for name, value in figures.items()))
    if args.out:
        args.out.write_text(json.dumps(figures, indent=1) + "\n")
    return 0
