# SPDX-License-Identifier: GPL-3.0-or-later
"""Preset sketches without and with Sheets, in water and in clay, which hides nothing.

python scripts/make_films.py --out docs/images/films.png
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
from liquid_splash_addon.blender.scene import studio
from liquid_splash_addon.core.refinement.presets import BARE
from liquid_splash_addon.core.refinement.settings import SheetSettings
from training.figures.picture import contact_sheet, titled

GREY = (0.45, 0.45, 0.47, 1.0)
CLAY = {"Base Color": (0.35, 0.5, 0.62, 1.0), "Roughness": 0.35}


def main() -> None:
    """Render all shots into one sheet: water above, clay below, for each sketch."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/films.png"))
    parser.add_argument("--sketches", nargs="+", default=["crown", "wave", "letter_s"])
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--size", type=int, nargs=2, default=(440, 330), metavar="PIXELS")
    options = parser.parse_args()
    pictures = []
    with tempfile.TemporaryDirectory() as folder:
        for name in options.sketches:
            pictures += row(name, options, Path(folder) / "shot.png")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    contact_sheet(pictures, columns=2).save(options.out)


def row(name: str, options: argparse.Namespace, path: Path) -> list[Image.Image]:
    """Return four pictures of a sketch: bare and with Sheets, in water and in clay."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    liquid_splash_addon.register()
    demo.draw(name)
    bpy.ops.splash.generate(start=BARE)
    splash = bpy.context.active_object
    demo.set_table(table.world_points(splash), options.samples, options.size)
    pictures = []
    for look in ("water", "clay"):
        if look == "clay":
            use_clay(splash)
        for title, steps in (("bare", ()), ("Sheets", (SheetSettings(),))):
            splash.splash_stack.items.clear()
            for step in steps:
                add_step(splash, step)
            refine.evaluate(splash)
            demo.render(path)
            pictures.append(titled(Image.open(path).convert("RGB"), f"{name}: {title}"))
    return pictures


def use_clay(splash: bpy.types.Object) -> None:
    """Give a splash a dull material, and plain light around it."""
    clay = bpy.data.materials.new("Clay")
    if bpy.app.version < (5, 0, 0):
        clay.use_nodes = True
    shader = next(n for n in clay.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    for name, value in CLAY.items():
        shader.inputs[name].default_value = value
    splash.data.materials[0] = clay
    bpy.context.scene.world = studio.world_of(GREY)
    bpy.data.objects.remove(bpy.data.objects["Table"])
    bpy.context.scene.view_settings.look = "None"


if __name__ == "__main__":
    main()
