# SPDX-License-Identifier: GPL-3.0-or-later
"""Use the installed extension in a Blender of its own; test_extension.py runs this file.

The last two arguments are what to do with it (MODES) and its path, or the address of a repository
that has it. Under Blender's module this installs it first, which a real Blender does from its
command line. Code that tries to reach another machine, or asks for its address, fails the test.
"""

import importlib.util
import json
import sys

import bpy  # isort: split

import addon_utils  # Blender's own; only bpy makes it importable
import numpy as np

ID = ".liquid_splash"


def install(source: str) -> None:
    """Install and enable the extension, as the preferences do: from disk or a repository."""
    bpy.ops.preferences.addon_enable(module="bl_pkg")
    if "://" not in source:
        bpy.ops.extensions.package_install_files(
            filepath=source, repo="user_default", enable_on_install=True
        )
        return
    # Blender asks for this even where the repository is a folder.
    bpy.context.preferences.system.use_online_access = True
    repos = bpy.context.preferences.extensions.repos
    repos.new(name="Splashes", module="user_default_remote", remote_url=source)
    number = len(repos) - 1
    bpy.ops.extensions.repo_sync(repo_index=number)
    bpy.ops.extensions.package_install(
        repo_index=number, pkg_id="liquid_splash", enable_on_install=True
    )
    bpy.context.preferences.system.use_online_access = False


def forbid_network() -> None:
    """Let every attempt to reach another machine raise an error from now on."""

    def watch(event: str, arguments: tuple) -> None:
        # Threads of asyncio and the like talk over sockets of no network.
        if event in ("socket.getaddrinfo", "socket.gethostbyname", "urllib.Request"):
            raise PermissionError(f"the extension asks the network: {event} {arguments}")
        if event == "socket.connect" and isinstance(arguments[1], tuple):
            raise PermissionError(f"the extension asks the network: {event} {arguments}")

    sys.addaudithook(watch)


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


def check_splash(name: str) -> None:
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
    noted = json.loads(bpy.context.preferences.addons[name].preferences.measured)
    assert noted == {"AUTO": splash.precision}, f"noted {noted}, used {splash.precision}"


def check_refinement_and_model(_name: str) -> None:
    """Use what comes after a splash: refinements, drops, and splashes as a model."""
    splash = next(item for item in bpy.context.scene.objects if item.type == "MESH")
    bpy.context.view_layer.objects.active = splash
    assert bpy.ops.splash.refinement_preset(preset="FRESH") == {"FINISHED"}
    assert bpy.ops.splash.drop_points() == {"FINISHED"}
    bpy.context.view_layer.objects.active = bpy.data.objects["Sketch"]
    assert bpy.ops.splash.preset_sketch(preset="CROWN") == {"FINISHED"}
    bpy.context.scene.splash.settings.resolution = "64"
    assert bpy.ops.splash.generate_layers() == {"FINISHED"}


def check_packages(_name: str) -> None:
    """Blender's NumPy is the one in use, and the others are those of the zip."""
    import torch

    folder = bpy.utils.user_resource("EXTENSIONS", path=".local")
    assert not np.__file__.startswith(folder), f"NumPy is shadowed by {np.__file__}"
    print(f"extension: torch {torch.__version__} of {torch.__file__}", flush=True)


def check_reloading(name: str) -> None:
    """Reload Scripts, as the Blender menu does: the add-on is there again, and so is its work."""
    before = sys.modules[name]
    bpy.ops.script.reload()
    assert sys.modules[name] is before or hasattr(sys.modules[name], "register")
    assert addon_utils.check(name) == (True, True), "the extension did not come back"
    (splash,) = (item for item in bpy.context.scene.objects if item.type == "MESH")
    assert splash.splash.version, "what it made is still known"
    bpy.context.view_layer.objects.active = splash
    assert bpy.ops.splash.regenerate() == {"FINISHED"}


MODES = {
    "enable": (),
    "splash": (check_splash, check_reloading),
    "everything": (check_splash, check_refinement_and_model, check_packages),
}
"""What to check of it while it is enabled."""


def main() -> None:
    """Install where that is still to do, then use the extension."""
    assert importlib.util.find_spec("liquid_splash_addon") is None, "this would find the checkout"
    mode, source = sys.argv[-2:]
    if bpy.app.module:
        install(source)
    name = next((n for n in bpy.context.preferences.addons.keys() if n.endswith(ID)), "")
    assert name.startswith("bl_ext."), "the extension is not enabled"
    assert addon_utils.check(name) == (True, True), "the extension did not register"
    forbid_network()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    for check in MODES[mode]:
        check(name)
    assert not bpy.app.online_access, "the tests' Blender is not to be online"
    addon_utils.disable(name)
    assert not hasattr(bpy.types.Object, "splash"), "the extension left a property behind"
    addon_utils.enable(name)  # and left so: nothing may be printed when Blender ends


if __name__ == "__main__":
    main()
    print("extension: works", flush=True)
