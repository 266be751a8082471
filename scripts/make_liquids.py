# SPDX-License-Identifier: GPL-3.0-or-later
"""Every liquid, with and without Sheets, and two liquids in one splash by the colours of strokes.

python scripts/make_liquids.py --out docs/images/liquids.png
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import bpy
import make_demo as demo
import scene as table
from PIL import Image

import liquid_splash_addon
from liquid_splash_addon.blender.data.refinements import add_step
from liquid_splash_addon.blender.jobs import refine
from liquid_splash_addon.core.liquids import LIQUIDS
from liquid_splash_addon.core.refinement.presets import BARE
from liquid_splash_addon.core.refinement.settings import (
    DropletSettings,
    RefinementSettings,
    SheetSettings,
    WaveSettings,
)
from training.figures.picture import contact_sheet, titled

STEPS: tuple[RefinementSettings, ...] = (DropletSettings(), WaveSettings())
WHITE, GREY = (1.0, 0.97, 0.93, 1.0), (0.42, 0.4, 0.39, 1.0)
"""Colours of the table's glow: coloured light would hide what a liquid lets through."""

STRIPES = {"MILK": (0.2, 0.075, 0.03), "PAINT": (0.02, 0.16, 0.6)}
"""Liquids that are striped, and the colour of every other stroke."""


def main() -> None:
    """Render all liquids into one sheet."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/liquids.png"))
    parser.add_argument("--sketch", default="crown")
    parser.add_argument("--liquids", nargs="+", default=list(LIQUIDS), choices=list(LIQUIDS))
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--size", type=int, nargs=2, default=(260, 195), metavar="PIXELS")
    options = parser.parse_args()
    liquid_splash_addon.register()
    pictures = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shot.png"
        for liquid in options.liquids:
            splash = new_splash(options, liquid)
            label = LIQUIDS[liquid].label
            sheets = (STEPS[0], SheetSettings(), STEPS[1])
            for title, steps in ((label, STEPS), (f"{label}: Sheets", sheets)):
                pictures.append(shot(splash, steps, title, path))
        for liquid in (name for name in STRIPES if name in options.liquids):
            splash = new_splash(options, liquid)
            stripe(splash, STRIPES[liquid])
            pictures.append(shot(splash, sheets, f"{LIQUIDS[liquid].label}: stripes", path))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    contact_sheet(pictures, columns=4).save(options.out, optimize=True)


def new_splash(options: argparse.Namespace, liquid: str) -> bpy.types.Object:
    """Return a splash of a liquid on a lit table."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.splash.liquid(liquid=liquid)
    demo.draw(options.sketch)
    bpy.ops.splash.generate(start=BARE)
    splash = bpy.context.active_object
    demo.set_table(table.world_points(splash), options.samples, options.size, glow=(WHITE, GREY))
    return splash


def shot(
    splash: bpy.types.Object, steps: tuple[RefinementSettings, ...], title: str, path: Path
) -> Image.Image:
    """Return a picture of a splash after ``steps``."""
    splash.splash_stack.items.clear()
    for step in steps:
        add_step(splash, step)
    refine.evaluate(splash)
    demo.render(path)
    return titled(Image.open(path).convert("RGB"), title)


def stripe(splash: bpy.types.Object, colour: tuple[float, float, float]) -> None:
    """Draw every other stroke in another colour, and let strokes colour the liquid."""
    sketch = splash.splash.sketch
    pen = bpy.data.materials.new("Pen")
    bpy.data.materials.create_gpencil_data(pen)
    pen.grease_pencil.color = (*colour, 1.0)
    sketch.data.materials.append(pen)
    for layer in sketch.data.layers:
        for number, stroke in enumerate(layer.current_frame().drawing.strokes):
            stroke.material_index = number % 2
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.regenerate()
    splash.splash_look.stroke_colours = True


if __name__ == "__main__":
    main()
