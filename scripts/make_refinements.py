# SPDX-License-Identifier: GPL-3.0-or-later
"""Before and after each refinement, as in the paper's Figs. 10 to 13.

python scripts/make_refinements.py --out docs/images/refinements.png
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import bpy
import make_demo as demo
import scene as table
from mathutils import Vector
from PIL import Image

import liquid_splash_addon
from liquid_splash_addon.blender.data.refinements import add_step
from liquid_splash_addon.blender.jobs import refine
from liquid_splash_addon.core.refinement.presets import BARE, PRESETS
from liquid_splash_addon.core.refinement.settings import (
    DropletSettings,
    RefinementSettings,
    RuptureSettings,
    WaveSettings,
)
from training.figures.picture import contact_sheet, titled

SHOTS: tuple[tuple[str, Sequence[RefinementSettings]], ...] = (
    ("before", ()),
    ("droplets (Figs. 10, 11)", (DropletSettings(amount=0.004),)),
    ("ruptures (5.1, the inverse)", (RuptureSettings(),)),
    ("preset Storm: ruptures and spray", PRESETS["STORM"].steps),
)
WAVES = WaveSettings(amplitude=0.002)
CLOSE = 0.45
"""Share of the picture's width that the close view of waves shows."""


def main() -> None:
    """Render all shots into one sheet."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/refinements.png"))
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--size", type=int, nargs=2, default=(560, 420), metavar="PIXELS")
    options = parser.parse_args()
    splash = make_splash(options)
    camera = bpy.context.scene.camera
    with tempfile.TemporaryDirectory() as folder:
        pictures = [shot(splash, steps, title, Path(folder)) for title, steps in SHOTS]
        approach(camera, splash)
        pictures.append(shot(splash, (), "before, close", Path(folder)))
        pictures.append(shot(splash, (WAVES,), "waves (Fig. 12)", Path(folder)))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    contact_sheet(pictures, columns=2).save(options.out)


def make_splash(options: argparse.Namespace) -> bpy.types.Object:
    """Return the example's splash on its table."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    liquid_splash_addon.register()
    demo.draw("crown")
    bpy.ops.splash.generate(start=BARE)
    splash = bpy.context.active_object
    demo.set_table(table.world_points(splash), options.samples, options.size)
    return splash


def shot(
    splash: bpy.types.Object, steps: Sequence[RefinementSettings], title: str, folder: Path
) -> Image.Image:
    """Return a picture of the splash with these refinements."""
    splash.splash_stack.items.clear()
    for step in steps:
        add_step(splash, step)
    refine.evaluate(splash)
    path = folder / "shot.png"
    demo.render(path)
    print(f"{title}: {splash.splash_stack.summary}", flush=True)
    return titled(Image.open(path).convert("RGB"), title)


def approach(camera: bpy.types.Object, splash: bpy.types.Object) -> None:
    """Turn the camera to a part of the rim, and zoom in."""
    corners = [splash.matrix_world @ Vector(corner) for corner in splash.bound_box]
    low, high = corners[0], corners[6]
    rim = Vector((0.7 * low.x + 0.3 * high.x, 0.5 * (low.y + high.y), 0.35 * low.z + 0.65 * high.z))
    camera.rotation_euler = (rim - camera.location).to_track_quat("-Z", "Y").to_euler()
    camera.data.lens /= CLOSE


if __name__ == "__main__":
    main()
