# SPDX-License-Identifier: GPL-3.0-or-later
"""Compile ahead, or use what was; test_compile_ahead.py runs this file in a Blender of its own.

The last arguments are what to do, the add-on's package and, to install it, the zip::

    prepare   compile ahead and wait for it
    use       do what users do, and print as JSON what had to be compiled and how long it took
"""

import importlib
import json
import sys
import time
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from installed_extension import arc, draw_sketch, install

LONGEST = 1200
"""Seconds that compiling ahead may take on a busy machine."""


def enable(package: str, path: str) -> None:
    """Register the add-on: from the checkout by hand, or as the installed extension."""
    if not package.startswith("bl_ext."):
        sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
        importlib.import_module(package).register()
    elif bpy.app.module:
        install(path)
    assert hasattr(bpy.types.Object, "splash"), "the add-on did not register"


def prepare(package: str) -> dict[str, object]:
    """Compile ahead."""
    compile_ahead = importlib.import_module(f"{package}.blender.jobs.compile_ahead")
    start = time.monotonic()
    ahead = compile_ahead.start()
    ahead.wait(LONGEST)
    compiled_code = importlib.import_module(f"{package}.core.compiled_code")
    return {
        "seconds": time.monotonic() - start,
        "share": ahead.share,
        "note": compile_ahead.note(),
        "complete": compiled_code.is_complete(),
        "folder": str(compiled_code.folder() or ""),
    }


def missed(package: str) -> dict[str, list[str]]:
    """Return the argument types that had to be compiled, by function."""
    from numba.core.dispatcher import Dispatcher

    return {
        f"{value.py_func.__module__}.{value.py_func.__name__}": [str(s) for s in misses]
        for name, module in list(sys.modules.items())
        if name.startswith(f"{package}.")
        for value in vars(module).values()
        if isinstance(value, Dispatcher) and (misses := value.stats.cache_misses)
    }


def obstacle() -> bpy.types.Collection:
    """Return a collection that holds a cube and, as an open sheet, a square."""
    collection = bpy.data.collections.new("Obstacles")
    bpy.context.scene.collection.children.link(collection)
    for add in (bpy.ops.mesh.primitive_cube_add, bpy.ops.mesh.primitive_plane_add):
        add(size=0.4, location=(0.5, 0.1, 0.5))
        item = bpy.context.active_object
        for home in list(item.users_collection):
            home.objects.unlink(item)
        collection.objects.link(item)
    return collection


def use() -> float:
    """Do what users do; return the seconds of the first splash."""
    sketch = draw_sketch([arc(angle) for angle in (0.2, 1.0, 1.7, 2.9, 4.4)])
    start = time.monotonic()
    assert bpy.ops.splash.generate(resolution="64") == {"FINISHED"}
    first = time.monotonic() - start
    splash = bpy.context.active_object
    for preset in ("FRESH", "STORM", "MILK", "FINGERS"):
        assert bpy.ops.splash.refinement_preset(preset=preset) == {"FINISHED"}
        assert not splash.splash_stack.warnings, splash.splash_stack.warnings
    splash.splash_obstacles.collection = obstacle()
    bpy.context.view_layer.objects.active = splash
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    assert bpy.ops.splash.refinement_apply() == {"FINISHED"}
    assert bpy.ops.splash.regenerate(resolution="128") == {"FINISHED"}
    bpy.ops.object.duplicate()
    bpy.context.active_object.location.x += 0.5
    splash.select_set(True)
    assert bpy.ops.splash.combine() == {"FINISHED"}
    model = next(i for i in bpy.context.scene.objects if i.splash_model.is_model)
    model.splash_model.settings.mirror_x = True
    model.splash_model.use_waves = True
    assert not model.splash_model.warnings, model.splash_model.warnings
    assert sketch.name
    return first


def main() -> None:
    """Do what the last arguments say."""
    what, package, *path = sys.argv[sys.argv.index("--") + 1 :]
    enable(package, *(path or [""]))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    found = prepare(package) if what == "prepare" else {"seconds": use(), "missed": missed(package)}
    print("found:", json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
