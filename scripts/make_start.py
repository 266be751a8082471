# SPDX-License-Identifier: GPL-3.0-or-later
"""Do what docs/start.md says, in the scene that Blender starts with, and render the picture there.

    python scripts/make_start.py --out docs/images/start.png

Only drawing is left to code: the preset crown.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import bpy

import liquid_splash_addon

SIZE, SAMPLES = (800, 450), 64


def make_splash() -> None:
    """Draw, generate and refine, by the buttons' operators."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.splash.preset_sketch(preset="CROWN")
    bpy.ops.splash.generate()
    splash = next(item for item in bpy.context.scene.objects if item.type == "MESH")
    bpy.context.view_layer.objects.active = splash
    for item in bpy.context.scene.objects:
        item.select_set(item == splash)


def look_from_the_side() -> None:
    """Turn the camera as one turns a view: nearly level, all of the splash in it."""
    bpy.context.scene.camera.rotation_euler = (1.38, 0.0, 0.8)
    bpy.context.view_layer.update()
    bpy.ops.view3d.camera_to_view_selected()


def light_with_a_sky(world: bpy.types.World) -> None:
    """Give the world a Sky Texture."""
    tree = world.node_tree
    background = tree.nodes["Background"]
    sky = tree.nodes.new("ShaderNodeTexSky")
    tree.links.new(sky.outputs["Color"], background.inputs["Color"])
    background.inputs["Strength"].default_value = 0.15


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
    out = parser.parse_args().out
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    liquid_splash_addon.register()
    make_splash()
    look_from_the_side()
    light_with_a_sky(bpy.context.scene.world)
    render(out)


if __name__ == "__main__":
    main()
