# SPDX-License-Identifier: GPL-3.0-or-later
"""Do what docs/start.md says, in the scene that Blender starts with, and render the picture there.

    python scripts/make_start.py --out docs/images/start.png
    python scripts/make_start.py --file FOLDER/first_flat.blend --out first_flat.png

Only drawing is left to code: the preset crown. A file has a splash already: the one that is drawn
with the mouse by ``tests/blender/flat_sketch_window.py``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import bpy
from mathutils import Vector

import liquid_splash_addon
from liquid_splash_addon.blender.scene import studio
from liquid_splash_addon.blender.ui.studio_operators import points_of

SIZE, SAMPLES = (800, 450), 64

FIRST_VIEW = (-0.819, 0.362, -0.446)
"""The way that one looks in the view that Blender starts with."""


def make_splash() -> None:
    """Draw, generate and refine, by the buttons' operators."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.splash.preset_sketch(preset="CROWN")
    bpy.ops.splash.generate()
    splash = next(item for item in bpy.context.scene.objects if item.type == "MESH")
    bpy.context.view_layer.objects.active = splash
    for item in bpy.context.scene.objects:
        item.select_set(item == splash)


def open_splash(path: Path) -> None:
    """Open a file with a splash, hide its sketch and select the splash."""
    bpy.ops.wm.open_mainfile(filepath=str(path.resolve()))
    for item in bpy.context.scene.objects:
        item.hide_render = item.type == "GREASEPENCIL"
        item.select_set(item.type == "MESH")


def render(path: Path) -> None:
    """Render with Cycles and motion blur."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = SAMPLES
    scene.render.use_motion_blur = True
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.filepath = str(path.resolve())
    bpy.ops.render.render(write_still=True)


def main() -> None:
    """Do the steps of the page, one after another."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/start.png"))
    parser.add_argument("--file", type=Path, help="with a splash in it, instead of making one")
    options = parser.parse_args()
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    liquid_splash_addon.register()
    if options.file is None:
        make_splash()
    else:
        open_splash(options.file)
    if options.file is None:
        bpy.ops.splash.studio()
    else:  # from where it was drawn
        splash = next(item for item in bpy.context.scene.objects if item.select_get())
        studio.build(bpy.context.scene, points_of([splash]), Vector(FIRST_VIEW))
    render(options.out)


if __name__ == "__main__":
    main()
