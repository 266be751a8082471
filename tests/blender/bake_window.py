# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_bake_window.py in a Blender with a window: bake, Esc, go on, render what was baked.

The keys are the window system's own, so Blender runs without simulated events: its jobs look for
Esc where the window gets it. With a folder as argument it saves a picture at each stage.
"""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np
from mathutils import Vector

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import bake_mantaflow, loaded_generator, work_queue
from liquid_splash_addon.blender.scene import fluid_domain
from tests.blender.running_scripts import Condition, run
from tests.blender.simulate_window import picture, still_running
from tests.blender.window_script import GENERATOR, draw, idle, press, splashes

FRAMES = 40


def real_key(name: str) -> None:
    """Press and release a key of the window system over Blender's window."""
    subprocess.run(["xdotool", "mousemove", "260", "300", "key", name], check=True)


def add_camera(middle: Vector) -> None:
    """Look at a place, in daylight, in a small picture."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = middle + Vector((0.8, -2.4, 1.0))
    camera.rotation_euler = (middle - camera.location).to_track_quat("-Z", "Y").to_euler()
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 4.0, (0.6, 0.3, 0.0)
    for item in (camera, sun):
        scene.collection.objects.link(item)
    scene.camera = camera
    scene.render.engine, scene.cycles.samples = "CYCLES", 4
    scene.render.resolution_x, scene.render.resolution_y = 160, 120


def render(folder: Path) -> Iterator[Condition]:
    """Render the frames as Ctrl F12 does, and check that each shows something else."""
    scene = bpy.context.scene
    folder.mkdir()
    scene.render.filepath = str(folder) + "/"
    scene.render.image_settings.file_format = "PNG"
    scene.frame_start, scene.frame_end, scene.frame_step = 2, 8, 3
    press_render()
    yield lambda: len([*folder.glob("*.png")]) == 3 and not bpy.app.is_job_running("RENDER")
    pictures = [pixels(path) for path in sorted(folder.glob("*.png"))]
    for first, second in pairwise(pictures):
        assert np.abs(first - second).mean() > 1e-3, "a frame shows what the one before shows"


def is_idle() -> bool:
    """Whether the queue has nothing left to do."""
    return work_queue.running() is None and not work_queue.is_waiting()


def press_render() -> None:
    """Start rendering the animation as its menu does."""
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window):
        bpy.ops.render.render("INVOKE_DEFAULT", animation=True)


def pixels(path: Path) -> np.ndarray:
    """Return a picture's numbers."""
    image = bpy.data.images.load(str(path))
    values = np.array(image.pixels[:], dtype=np.float32)
    bpy.data.images.remove(image)
    return values


def baking(folder: Path) -> Iterator[Condition]:
    """Check that Esc keeps what is baked, that Bake goes on from it, and that it renders."""
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "bake.blend"))
    draw()
    press("splash.generate")
    yield idle
    splash = splashes()[0]
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.refinement_add("EXEC_DEFAULT", True, kind="WAVES")
    yield is_idle
    settings = bpy.context.scene.splash_mantaflow.settings
    settings.resolution, settings.frames = 64, FRAMES
    press("splash.mantaflow_export")
    yield idle
    domain = next(item for item in bpy.data.objects if fluid_domain.settings_of(item))
    fluid = fluid_domain.settings_of(domain)
    assert press("splash.mantaflow_bake") == {"FINISHED"}
    yield lambda: bake_mantaflow.last_frame(domain) > domain.splash_domain.frame + 1
    yield from picture("baking")
    before = splash.splash_stack.evaluated
    splash.splash_stack.items[0].show = False
    yield lambda: bake_mantaflow.last_frame(domain) > domain.splash_domain.frame + 3
    assert splash.splash_stack.evaluated == before, "nothing is written while a bake reads"
    real_key("Escape")
    yield lambda: not fluid_domain.is_baking(fluid) and not bake_mantaflow._waiting
    done = bake_mantaflow.last_frame(domain)
    assert domain.splash_domain.frame < done < fluid.cache_frame_end, "Esc stops and keeps"
    assert not splash.hide_render, "the splash stays until all is baked"
    yield is_idle
    assert splash.splash_stack.evaluated != before, "and then it is"
    splash.splash_stack.items[0].show = True
    yield is_idle
    yield from picture("stopped")
    assert press("splash.mantaflow_bake") == {"FINISHED"}
    yield lambda: fluid.has_cache_baked_mesh and not bake_mantaflow._waiting
    assert bake_mantaflow.last_frame(domain) == fluid.cache_frame_end
    assert domain.splash_domain.verified and splash.hide_render
    add_camera(domain.matrix_world.translation)
    domain.data.materials.clear()
    yield from render(folder / "mantaflow")
    yield from picture("rendered")
    domain.hide_render, splash.hide_render, splash.hide_viewport = True, False, False
    bpy.context.view_layer.objects.active = splash
    record = splash.splash_simulation
    record.settings.frames, record.settings.resolution = 8, "64"
    press("splash.simulate")
    yield lambda: not still_running() and record.frames == 9
    yield from render(folder / "ours")


if __name__ == "__main__":
    liquid_splash_addon.register()
    loaded_generator.get = lambda *_: GENERATOR
    bpy.context.preferences.view.show_splash = False
    place = Path(tempfile.mkdtemp())
    print(place, flush=True)
    bpy.app.timers.register(run(baking(place)), first_interval=1.0, persistent=True)
