# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface for scripts, in Blender."""

import bpy
import numpy as np
import pytest

from liquid_splash_addon import api


@pytest.fixture(scope="module")
def splash() -> api.Splash:
    """Return a pyramid and a free drop: what networks give is tested without Blender."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], dtype=np.int32)
    drops = api.Drops(
        np.array([[2, 2, 2]], dtype=np.float32), np.array([[0, 0, 5]], dtype=np.float32),
        np.array([0.01], dtype=np.float32), np.array([False]),
    )  # fmt: skip
    return api.Splash(vertices, faces, np.float32(10) * vertices, drops)


def attribute(data: bpy.types.Mesh, name: str, kind: str, width: int) -> np.ndarray:
    """Return the values of a point attribute, ``(n, width)``."""
    values = np.empty(len(data.vertices) * width, dtype=np.float32)
    data.attributes[name].data.foreach_get(kind, values)
    return values.reshape(-1, width)


def test_a_splash_becomes_an_object_with_velocity(splash) -> None:
    made = splash.to_object("Pyramid")
    assert made.name == "Pyramid" and made.name in bpy.context.scene.objects
    np.testing.assert_array_equal(attribute(made.data, "position", "vector", 3), splash.vertices)
    np.testing.assert_array_equal(attribute(made.data, "velocity", "vector", 3), splash.velocities)
    assert made.data.materials[0] is not None


def test_blender_imports_what_is_saved_as_ply(splash, tmp_path) -> None:
    splash.save(tmp_path / "splash.ply")
    bpy.ops.wm.ply_import(filepath=str(tmp_path / "splash.ply"), forward_axis="Y", up_axis="Z")
    data = bpy.context.object.data
    wanted = np.concatenate([splash.vertices, splash.drops.positions])
    np.testing.assert_array_equal(attribute(data, "position", "vector", 3), wanted)
    speeds = np.concatenate([splash.velocities, splash.drops.velocities])
    for column, axis in enumerate("xyz"):
        found = attribute(data, f"velocity_{axis}", "value", 1)[:, 0]
        np.testing.assert_array_equal(found, speeds[:, column])
    assert attribute(data, "radius", "value", 1)[-1, 0] == np.float32(0.01)
    assert len(data.polygons) == 4


def test_blender_imports_what_is_saved_as_obj(splash, tmp_path) -> None:
    splash.save(tmp_path / "splash.obj")
    bpy.ops.wm.obj_import(filepath=str(tmp_path / "splash.obj"), forward_axis="Y", up_axis="Z")
    data = bpy.context.object.data
    np.testing.assert_array_equal(attribute(data, "position", "vector", 3), splash.vertices)
    assert [tuple(face.vertices) for face in data.polygons] == list(map(tuple, splash.faces))
