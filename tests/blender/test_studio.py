# SPDX-License-Identifier: GPL-3.0-or-later
"""The studio: what is around liquid that is to be seen."""

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector

from liquid_splash_addon.blender.scene import studio
from liquid_splash_addon.blender.ui.look_panel import SPLASH_PT_look
from liquid_splash_addon.blender.ui.studio_operators import LOWEST, points_of, view_of
from tests.blender.drawing_panels import drawn
from tests.blender.sketching import add_sketch, fan, generate

pytestmark = pytest.mark.usefixtures("tubes")


@pytest.fixture
def splash() -> bpy.types.Object:
    """A splash away from the origin, half its size."""
    add_sketch(fan(), Matrix.Translation((3, -2, 1)) @ Matrix.Scale(0.5, 4))
    return generate()


def counts() -> list[int]:
    """How much there is of what the studio is made of."""
    kinds = ("objects", "meshes", "lights", "cameras", "worlds", "materials", "collections")
    return [len(getattr(bpy.data, kind)) for kind in kinds]


def seen(item: bpy.types.Object) -> np.ndarray:
    """Return where the scene's camera sees vertices, across, up and ahead, ``(n, 3)``."""
    scene = bpy.context.scene
    return np.array(
        [world_to_camera_view(scene, scene.camera, Vector(point)) for point in points_of([item])]
    )


def test_the_camera_sees_all_of_it_with_air_around(splash, capfd):
    assert bpy.ops.splash.studio() == {"FINISHED"}
    assert "Press F12 to render" in "".join(capfd.readouterr())
    across, up, ahead = seen(splash).T
    for place in (across, up):
        assert 0 < place.min() and place.max() < 1
    assert max(np.ptp(across), np.ptp(up)) > 0.6, "it fills the picture"
    lens = bpy.context.scene.camera.data
    assert lens.clip_start < ahead.min() and ahead.max() < lens.clip_end


def test_the_table_is_under_it_and_glows_behind_it(splash):
    bpy.ops.splash.studio(glow="WARM")
    table = next(item for item in bpy.data.objects if item.name.startswith("Table"))
    points = points_of([splash])
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    assert abs(table.location.z - points[:, 2].min()) < 0.02 * size
    towards = Vector(points.mean(axis=0)) - bpy.context.scene.camera.location
    behind = table.location - Vector(points.mean(axis=0))
    assert behind.dot(towards) > 0, "beyond the liquid, as the camera sees it"
    lights = [item for item in studio.studio_in(bpy.context.scene).objects if item.type == "LIGHT"]
    assert len(lights) == 4 and all(light.location.z > table.location.z for light in lights)


def test_again_it_moves_and_leaves_nothing_behind(splash, capfd):
    bpy.ops.splash.studio()
    before, camera = counts(), bpy.context.scene.camera.location.copy()
    splash.matrix_world = Matrix.Translation((9, 0, 0)) @ splash.matrix_world
    bpy.context.view_layer.update()
    bpy.ops.splash.studio(glow="WARM")
    assert counts() == before
    np.testing.assert_allclose(bpy.context.scene.camera.location - camera, (9, 0, 0), atol=1e-3)
    bpy.ops.splash.studio(camera=False)
    assert bpy.context.scene.camera is None and len(bpy.data.cameras) == before[3] - 1
    assert "The studio is there" in "".join(capfd.readouterr())


def test_the_scenes_own_camera_comes_back_without_the_studios(splash):
    own = bpy.data.objects.new("Own", bpy.data.cameras.new("Own"))
    bpy.context.scene.collection.objects.link(own)
    bpy.context.scene.camera = own
    for _ in range(2):
        bpy.ops.splash.studio()
        assert bpy.context.scene.camera != own
    bpy.ops.splash.studio(camera=False)
    assert bpy.context.scene.camera == own
    bpy.ops.splash.studio()
    bpy.data.objects.remove(own)
    bpy.ops.splash.studio(camera=False)
    assert bpy.context.scene.camera is None


def test_what_the_scene_had_stays(splash, tmp_path):
    scene = bpy.context.scene
    scene.world, camera = bpy.data.worlds.new("Mine"), bpy.data.objects.new("Mine", None)
    scene.collection.objects.link(camera)
    bpy.ops.splash.studio()
    light = bpy.data.objects.new("Fill", bpy.data.lights.new("Fill", "POINT"))
    studio.studio_in(scene).objects.link(light)
    scene.collection.objects.link(light)  # the artist's, in two collections
    bpy.ops.splash.studio()
    assert light.name in bpy.data.objects and camera.name in bpy.data.objects
    path = str(tmp_path / "studio.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert "Mine" in bpy.data.worlds and studio.MARK in bpy.context.scene.world


def test_without_liquid_it_says_what_to_do():
    with pytest.raises(RuntimeError, match="Select a splash first"):
        bpy.ops.splash.studio()
    assert studio.studio_in(bpy.context.scene) is None


def test_a_view_from_below_is_turned_down(splash):
    class Area:
        type = "VIEW_3D"

    class Looking:
        area = Area()

    for way, wanted in (((0, 0, -1), -1.0), ((0, 1, 0.5), LOWEST), ((0, 0, 1), LOWEST)):
        region = type("Region", (), {"view_rotation": Vector(way).to_track_quat("-Z", "Y")})
        Area.spaces = type("S", (), {"active": type("A", (), {"region_3d": region})})
        view = view_of(Looking())
        assert view.z == pytest.approx(wanted, abs=0.02) and view.length == pytest.approx(1)


def test_the_panel_has_it(splash):
    assert "splash.studio" in drawn(SPLASH_PT_look)
