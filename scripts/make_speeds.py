# SPDX-License-Identifier: GPL-3.0-or-later
"""One sketch drawn slowly and fast, as in the paper's Fig. 7.

python scripts/make_speeds.py --out docs/images/speeds.png
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
from liquid_splash_addon.core.refinement.presets import BARE
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.presets import PRESETS as PRESET_SKETCHES
from training.figures.picture import contact_sheet, titled

SPEEDS = (0.15, 0.25, 0.4, 1.0)
"""Of the hand, m/s at real size."""


def main() -> None:
    """Render one splash for each speed into one sheet."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/speeds.png"))
    parser.add_argument("--sketch", choices=sorted(map(str.lower, PRESET_SKETCHES)), default="wave")
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--size", type=int, nargs=2, default=(560, 420), metavar="PIXELS")
    options = parser.parse_args()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    liquid_splash_addon.register()
    sketch = demo.draw(options.sketch)
    demo.set_table(table.world_points(drawn_at(sketch, SPEEDS[-1])), options.samples, options.size)
    with tempfile.TemporaryDirectory() as folder:
        pictures = [shot(sketch, speed, Path(folder)) for speed in SPEEDS]
    options.out.parent.mkdir(parents=True, exist_ok=True)
    contact_sheet(pictures, columns=2).save(options.out)


def drawn_at(sketch: bpy.types.Object, speed: float) -> bpy.types.Object:
    """Return the splash of the sketch, as if drawn at one speed."""
    bpy.context.view_layer.objects.active = sketch
    bpy.ops.splash.generate(speed_source="CONSTANT", stroke_speed=speed, start=BARE)
    return next(item for item in bpy.data.objects if item.splash.summary)


def shot(sketch: bpy.types.Object, speed: float, folder: Path) -> Image.Image:
    """Return a picture of the splash at one speed of the hand."""
    splash = drawn_at(sketch, speed)
    title = f"{speed * SplashSettings().speed_gain:g} m/s"
    print(f"{title}: {splash.splash.summary}", flush=True)
    path = folder / "shot.png"
    demo.render(path)
    return titled(Image.open(path).convert("RGB"), title)


if __name__ == "__main__":
    main()
