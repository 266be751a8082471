# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur in Cycles: streaks are as long as velocity and shutter say.

A picture smeared evenly along a streak of length s is as much wider as it ought to be: the variance
of its brightness grows by s^2 / 12.
"""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.scene import drop_points, motion_object
from liquid_splash_addon.blender.scene.material import water_material
from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.playback.files import FILE
from liquid_splash_addon.core.playback.ply import ply_bytes
from tests.blender.sketching import add_sketch, generate, line, vertices

FPS = 25
WIDTH = 8.0
"""Of the picture, Blender units."""

PIXELS = (128, 32)
TOLERANCE = 0.03
"""Of the streaks, relative: brightness is sampled."""

pytestmark = pytest.mark.skipif(
    not hasattr(bpy.types, "CyclesRenderSettings")
    and "cycles" not in bpy.context.preferences.addons,
    reason="this Blender has no Cycles",
)


@pytest.fixture(autouse=True)
def studio():
    """Set up a glowing liquid before black, seen from above."""
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = FPS, 1.0
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", WIDTH
    camera.location = (0, 0, 6)
    scene.collection.objects.link(camera)
    scene.camera = camera
    inputs = water_material().node_tree.nodes["Principled BSDF"].inputs
    inputs["Transmission Weight"].default_value = 0.0
    inputs["Base Color"].default_value = (0, 0, 0, 1)
    inputs["Emission Color"].default_value = (1, 1, 1, 1)
    inputs["Emission Strength"].default_value = 0.5
    scene.world = None
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 64, False
    scene.cycles.max_bounces = 0
    scene.render.resolution_x, scene.render.resolution_y = PIXELS
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.frame_set(10)


@pytest.fixture
def splash(tubes) -> bpy.types.Object:
    """Return a short broad jet along x of one velocity, 60 units a second in real time."""
    add_sketch([line((-0.3, y, 0), (0.3, y, 0), speed=15.0) for y in np.linspace(-0.7, 0.7, 15)])
    splash = generate(real_size=0.1)
    speed = vertices(splash, "velocity")
    assert np.ptp(speed, axis=0).max() < 0.02 * np.abs(speed).max()
    return splash


def spread(folder, shutter: float) -> float:
    """Return the variance of the brightness along x of the rendered scene, units^2."""
    render = bpy.context.scene.render
    render.use_motion_blur, render.motion_blur_shutter = shutter > 0, max(shutter, 0.1)
    render.filepath = str(folder / "blur.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    bright = np.array(image.pixels[:]).reshape(PIXELS[1], PIXELS[0], 4)[:, :, 0].sum(axis=0)
    bpy.data.images.remove(image)
    assert bright.sum() > 0 and bright[0] == bright[-1] == 0
    x = (np.arange(PIXELS[0]) + 0.5) * WIDTH / PIXELS[0]
    mean = (bright * x).sum() / bright.sum()
    return float((bright * (x - mean) ** 2).sum() / bright.sum())


def streak(folder, shutter: float, still: float) -> float:
    """Return the length of the streaks, given the variance of the sharp picture."""
    return float(np.sqrt(12 * max(spread(folder, shutter) - still, 0.0)))


def mean_speed(item: bpy.types.Object) -> float:
    """Return the mean velocity along x."""
    return float(vertices(item, "velocity")[:, 0].mean())


def test_streaks_are_as_long_as_the_shutter_is_open(splash, tmp_path):
    splash.splash_motion.time_scale = 1.0
    speed, still = mean_speed(splash), spread(tmp_path, 0.0)
    assert speed == pytest.approx(60, rel=0.1)
    for shutter in (0.5, 1.0):
        expected = speed * shutter / FPS
        assert streak(tmp_path, shutter, still) == pytest.approx(expected, rel=TOLERANCE)
    splash.splash_motion.time_scale = 0.5
    expected = speed * 0.5 / FPS
    assert streak(tmp_path, 1.0, still) == pytest.approx(expected, rel=TOLERANCE)


def test_a_moving_object_adds_to_the_streaks(splash, tmp_path):
    splash.splash_motion.time_scale = 0.5
    still, own = spread(tmp_path, 0.0), mean_speed(splash)
    for frame, x in ((0, -8.0), (20, 8.0)):  # 20 units a second, the same way
        splash.location.x = x
        splash.keyframe_insert("location", frame=frame)
    for strip in splash.animation_data.action.layers[0].strips:
        for curve in strip.channelbag(splash.animation_data.action_slot).fcurves:
            for point in curve.keyframe_points:
                point.interpolation = "LINEAR"
    bpy.context.scene.frame_set(10)
    expected = (own + 20) / FPS
    assert streak(tmp_path, 1.0, still) == pytest.approx(expected, rel=TOLERANCE)


def test_topology_may_change_from_frame_to_frame(splash, tmp_path):
    splash.splash_motion.time_scale = 0.5
    build = splash.modifiers.new("Build", "BUILD")  # other vertices on every frame
    build.frame_start, build.frame_duration = 1, 12
    build.use_random_order = True
    bpy.context.scene.frame_set(10)
    still = spread(tmp_path, 0.0)
    expected = mean_speed(splash) / FPS
    assert streak(tmp_path, 1.0, still) == pytest.approx(expected, rel=2 * TOLERANCE)


def test_free_drops_smear_too(splash, tmp_path):
    splash.hide_render = True
    drop_points.ensure(splash)
    count = 5
    positions = np.zeros((count, 3), dtype=np.float32)
    positions[:, 1] = np.linspace(-0.5, 0.5, count)
    drop_points.write(
        splash,
        SimpleNamespace(
            positions=positions,
            velocities=np.tile(np.float32([60.0, 0, 0]), (count, 1)),
            radii=np.full(count, 0.1, dtype=np.float32),
            meshed=np.zeros(count, dtype=bool),
        ),
    )
    splash.splash_motion.time_scale = 0.5
    still = spread(tmp_path, 0.0)
    assert streak(tmp_path, 1.0, still) == pytest.approx(30 / FPS, rel=TOLERANCE)


def test_a_preview_smears_as_it_flies(splash, tmp_path):
    """Its moving vertices must not add to the velocity a second time."""
    splash.splash_motion.time_scale = 0.5
    splash.splash_motion.gravity = 0.0
    bpy.ops.splash.ballistic_preview()
    still = spread(tmp_path, 0.0)
    expected = mean_speed(splash) / FPS
    assert streak(tmp_path, 1.0, still) == pytest.approx(expected, rel=TOLERANCE)


def test_simulated_frames_smear_by_their_velocity(splash, tmp_path):
    """Other vertices in every frame, which moves as far as its velocity says."""
    mesh, drops = jet(), None
    for number in range(12):
        moved = mesh(number, x=0.8 * number - 4.0)
        name = FILE.format(number=number)
        (tmp_path / name).write_bytes(ply_bytes(moved, drops))
    splash.hide_render = True
    motion_object.ensure(splash)
    motion_object.show(splash, str(tmp_path), 5, 12)  # frame 10 shows number 5, in the middle
    bpy.context.scene.frame_set(10)
    still = spread(tmp_path, 0.0)
    for shutter in (0.5, 1.0):
        expected = 0.8 * shutter
        assert streak(tmp_path, shutter, still) == pytest.approx(expected, rel=2 * TOLERANCE)


def jet():
    """Return what makes a square of ``8 + number`` vertices a side, 20 units a second fast."""

    def mesh(number: int, x: float) -> Mesh:
        side = 8 + number
        place = np.linspace(-0.5, 0.5, side)
        flat_grid = np.stack(np.meshgrid(place, place, indexing="ij"), axis=-1).reshape(-1, 2)
        points = np.column_stack([flat_grid + [x, 0], np.zeros(side**2)]).astype(np.float32)
        first = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
        faces = np.concatenate([
            np.stack([first, first + side, first + 1], axis=1),
            np.stack([first + 1, first + side, first + side + 1], axis=1),
        ])  # fmt: skip
        velocity = np.tile(np.float32([0.8 * FPS, 0, 0]), (side**2, 1))
        return Mesh(points, faces.astype(np.int32), velocity)

    return mesh
