# SPDX-License-Identifier: GPL-3.0-or-later
"""From a sketch to a picture: the same steps a user takes, without the user.

    python scripts/make_demo.py --out out

Makes a scene with a real Grease Pencil sketch, runs the operator behind *Generate Splash*,
saves demo.blend and renders demo.png.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import bpy
import numpy as np
import scene as table
from mathutils import Vector

import liquid_splash_addon
from liquid_splash_addon.blender.scene import sketch as sketches
from liquid_splash_addon.blender.scene import studio
from liquid_splash_addon.blender.scene.grease_pencil import read_drawings
from liquid_splash_addon.blender.scene.places import rigid_matrix
from liquid_splash_addon.core.refinement.presets import STARTS
from liquid_splash_addon.core.sketch.presets import PRESETS as PRESET_SKETCHES
from liquid_splash_addon.core.sketch.presets import example_sketch

VIEW = Vector((0.25, 1.0, -0.28)).normalized()
STROKE_COLOUR = (1.0, 0.18, 0.02, 1.0)


def main() -> None:
    """Make the demo."""
    options = read_options()
    options.out.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()

    def say(stage: str) -> None:
        print(f"[{time.perf_counter() - start:5.1f} s] {stage}", flush=True)

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    liquid_splash_addon.register()
    say(f"Drawing the sketch '{options.sketch}' with Grease Pencil")
    sketch = draw(options.sketch)
    say("Generating the splash")
    bpy.ops.splash.generate(seed=options.seed, start=options.refine)
    splash = bpy.context.active_object
    say(f"{splash.splash.summary} on {splash.splash.device}, {splash.splash.precision}")
    for warning in filter(None, splash.splash.warnings.split("\n")):
        say(f"Warning: {warning}")
    say("Setting up lights and camera")
    set_table(table.world_points(splash), options.samples, options.size)
    if options.strokes:
        show_strokes(sketch, 0.006 * max(splash.dimensions))
    bpy.context.view_layer.objects.active = sketch
    say(f"Saving {options.out / 'demo.blend'}")
    bpy.ops.wm.save_as_mainfile(filepath=str(options.out.resolve() / "demo.blend"))
    say(f"Rendering {options.out / 'demo.png'}, {options.samples} samples")
    render(options.out.resolve() / "demo.png")
    say("Done")


def read_options() -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder of the results")
    parser.add_argument(
        "--sketch", choices=sorted(map(str.lower, PRESET_SKETCHES)), default="crown"
    )
    parser.add_argument("--strokes", action="store_true", help="show them in the picture")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--refine", choices=list(STARTS), default="FRESH", help="preset")
    parser.add_argument("--samples", type=int, default=32, help="of Cycles, per pixel")
    parser.add_argument("--size", type=int, nargs=2, default=(960, 540), metavar="PIXELS")
    return parser.parse_args()


def draw(name: str) -> bpy.types.Object:
    """Return a Grease Pencil object, active, that holds an example sketch and its times."""
    sketch = sketches.new_sketch(bpy.context)
    sketches.add_strokes(sketch, example_sketch(name))
    bpy.context.view_layer.objects.active = sketch
    return sketch


def set_table(
    points: np.ndarray,
    samples: int,
    size: tuple[int, int],
    view: Vector = VIEW,
    margin: float = 0.25,
    glow: Sequence[Any] = studio.BLUE,
) -> None:
    """Put table, lights and camera around ``points`` ``(n, 3)``, seen along ``view``.

    margin : air around them, over their size
    """
    scene = bpy.context.scene
    table.use_cycles(scene, samples, size)
    studio.build(scene, points, view, glow, margin)


def show_strokes(sketch: bpy.types.Object, width: float) -> list[bpy.types.Object]:
    """Draw the strokes as glowing lines: Cycles does not render Grease Pencil headless."""
    drawings, _ = read_drawings(sketch)
    lines = [table.add_line(drawing.points, width, STROKE_COLOUR) for drawing in drawings]
    for line in lines:
        line.matrix_world = rigid_matrix(sketch)
    return lines


def render(path: Path) -> None:
    """Render the scene's camera view to ``path``; what Blender says goes to a log beside it."""
    bpy.context.scene.render.filepath = str(path)
    sys.stdout.flush()
    # Blender prints several lines a second, from C: only file descriptors can be turned away.
    terminal = [os.dup(number) for number in (1, 2)]
    with path.with_suffix(".log").open("w") as log:
        for number in (1, 2):
            os.dup2(log.fileno(), number)
        try:
            bpy.ops.render.render(write_still=True)
        finally:
            for number, original in enumerate(terminal, start=1):
                os.dup2(original, number)
                os.close(original)


if __name__ == "__main__":
    main()
