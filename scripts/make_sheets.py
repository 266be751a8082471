# SPDX-License-Identifier: GPL-3.0-or-later
"""Make docs/images/sheets.png: one splash simulated in four ways.

    python scripts/make_sheets.py --out docs/images/sheets.png

From left to right: FLIP as it is mostly done (0.95, steps of 2 cells), APIC without care for
sheets, APIC with resampled sheets, and that with surface tension too.
"""

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from liquid_splash_addon.core.fluid.step import Physics, advance
from liquid_splash_addon.core.grid import LOCAL_SPACING
from training.figures.picture import contact_sheet, draw_liquid
from training.scenes.families import random_scene
from training.simulation.snapshot import take_frame

SEED, TIMES = 8, (0.09, 0.15)
"""A streamlet on a ball, and the moments shown, seconds after impact."""

WAYS = (
    Physics(flip=0.95, sheets=False, density=False, cfl=2.0),
    Physics(sheets=False),
    Physics(),
    Physics(tension=True),
)


def draw(physics: Physics, pixels: int):
    """Return pictures of the splash at TIMES."""
    scene = random_scene(SEED)
    world, liquid = scene.world(physics), scene.liquid()
    pictures = []
    for time in TIMES:
        liquid = advance(liquid, world, scene.impact + time)
        frame = take_frame(liquid, world, scene.spacing, scene.spacing, time)
        middle = np.argwhere(frame.distance < 0).mean(axis=0) + 0.5
        field = frame.signed_distance
        pictures.append(draw_liquid(field, pixels, centre=middle, width=0.4 / LOCAL_SPACING))
    return pictures


def main() -> None:
    """Draw all ways, two at once."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/images/sheets.png"))
    parser.add_argument("--pixels", type=int, default=300)
    args = parser.parse_args()
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        columns = list(pool.map(partial(draw, pixels=args.pixels), WAYS))
    rows = [column[n] for n in range(len(TIMES)) for column in columns]
    contact_sheet(rows, len(WAYS)).save(args.out)


if __name__ == "__main__":
    main()
