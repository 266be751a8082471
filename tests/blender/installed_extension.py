# SPDX-License-Identifier: GPL-3.0-or-later
"""Use the installed extension in a Blender of its own; test_extension.py runs this file.

The zip's path is the last argument. Under Blender's module this installs it first, which a
real Blender does from its command line.
"""

import importlib.util
import json
import sys

import bpy  # isort: split

import addon_utils  # Blender's own; only bpy makes it importable
import numpy as np

NAME = "bl_ext.user_default.liquid_splash"


def install(path: str) -> None:
    """Install and enable the extension, as Install from Disk in the preferences does."""
    bpy.ops.preferences.addon_enable(module="bl_pkg")
    bpy.ops.extensions.package_install_files(
        filepath=path, repo="user_default", enable_on_install=True
    )


def arc(angle: float, count: int = 40) -> np.ndarray:
    """Return points (count, 3) that rise, spread and fall over about one unit."""
    share = np.linspace(0.0, 1.0, count)
    outward = 0.1 + 0.7 * share
    height = 1.2 * share * (1.2 - share)
    return np.stack([outward * np.cos(angle), outward * np.sin(angle), height], axis=1)


def draw_sketch(strokes: list[np.ndarray], seconds: float = 0.5) -> bpy.types.Object:
    """Make an active Grease Pencil object with strokes that each took some seconds."""
    library = bpy.data.grease_pencils
    if bpy.app.version < (5, 0, 0):
        library = bpy.data.grease_pencils_v3
    data = library.new("Sketch")
    drawing = data.layers.new("Strokes").frames.new(1).drawing
    drawing.add_strokes([len(points) for points in strokes])
    times = np.concatenate([np.linspace(0.0, seconds, len(points)) for points in strokes])
    points = np.concatenate(strokes)
    drawing.attributes["position"].data.foreach_set("vector", points.ravel().astype(np.float32))
    timing = drawing.attributes.new("delta_time", "FLOAT", "POINT")
    timing.data.foreach_set("value", times.astype(np.float32))
    drawing.tag_positions_changed()
    sketch = bpy.data.objects.new("Sketch", data)
    bpy.context.collection.objects.link(sketch)
    bpy.context.view_layer.objects.active = sketch
    return sketch


def check_splash() -> None:
    """Generate a splash from a sketch and look at what it is."""
    draw_sketch([arc(angle) for angle in (0.2, 1.0, 1.7, 2.9, 4.4)])
    assert bpy.ops.splash.generate(resolution="64") == {"FINISHED"}
    meshes = [item.data for item in bpy.context.scene.objects if item.type == "MESH"]
    assert len(meshes) == 1, f"one mesh object expected, there are {len(meshes)}"
    assert len(meshes[0].vertices) > 100, f"only {len(meshes[0].vertices)} vertices"
    velocity = meshes[0].attributes["velocity"]
    assert (velocity.data_type, velocity.domain) == ("FLOAT_VECTOR", "POINT")
    # The fastest number format was measured, and is kept for the next splash.
    splash = next(item for item in bpy.context.scene.objects if item.type == "MESH").splash
    noted = json.loads(bpy.context.preferences.addons[NAME].preferences.measured)
    assert noted == {"AUTO": splash.precision}, f"noted {noted}, used {splash.precision}"


def main() -> None:
    """Install where that is still to do, then use the extension."""
    assert importlib.util.find_spec("liquid_splash_addon") is None, "this would find the checkout"
    if bpy.app.module:
        install(sys.argv[-1])
    assert NAME in bpy.context.preferences.addons, "the extension is not enabled"
    assert addon_utils.check(NAME) == (True, True), "the extension did not register"
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    check_splash()
    addon_utils.disable(NAME)
    assert not hasattr(bpy.types.Object, "splash"), "the extension left a property behind"
    addon_utils.enable(NAME)  # and left so: nothing may be printed when Blender ends


if __name__ == "__main__":
    main()
    print("extension: works", flush=True)
