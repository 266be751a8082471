# SPDX-License-Identifier: GPL-3.0-or-later
"""A slab of a liquid before a glowing wall: how much light an engine lets through.

As a script it renders with EEVEE, which needs a process of its own: without a graphics library
Blender ends. Its arguments are a folder for the picture and liquids; it prints their colours.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np
from mathutils import Matrix

from liquid_splash_addon.blender.data.look import METRES

EEVEE = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0, 0) else "BLENDER_EEVEE"


def shot(
    folder: Path,
    material: bpy.types.Material,
    thick: float,
    metres: float,
    engine: str = "CYCLES",
) -> np.ndarray:
    """Return the colour of a glowing wall seen through a slab, linear, over the wall's own."""
    scene = bpy.context.scene
    for item in [*scene.objects]:
        bpy.data.objects.remove(item)
    wall = bpy.data.worlds.new("Wall")
    if bpy.app.version < (5, 0, 0):
        wall.use_nodes = True
    background = next(n for n in wall.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    scene.world = wall
    bpy.ops.mesh.primitive_cube_add(size=1)
    slab = bpy.context.active_object
    slab.data.transform(Matrix.Diagonal((20, 20, thick, 1)))
    slab.scale = (0.5, 0.5, 0.5)
    slab.data.materials.append(material)
    slab[METRES] = metres / 2
    known = slab.data.attributes.new("thickness", "FLOAT", "POINT")  # metres, as EEVEE is told
    known.data.foreach_set("value", np.full(8, thick * metres / 2, dtype=np.float32))
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.location = (0, 0, 5)
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 0.01
    scene.collection.objects.link(scene.camera)
    scene.render.engine = engine
    scene.cycles.samples, scene.cycles.use_denoising = 64, False
    scene.eevee.taa_render_samples = 1
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(folder / "shot.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(image.pixels[:]).reshape(-1, 4)[:, :3]
    bpy.data.images.remove(image)
    return pixels.mean(axis=0)


if __name__ == "__main__":
    import liquid_splash_addon
    from liquid_splash_addon.blender.scene.liquid_materials import material_of

    liquid_splash_addon.register()
    where, *liquids = sys.argv[sys.argv.index("--") + 1 :]
    seen = {name: shot(Path(where), material_of(name), 2.0, 0.01, EEVEE) for name in liquids}
    print("seen:", json.dumps({name: list(map(float, seen[name])) for name in seen}), flush=True)
    os._exit(0)
