# SPDX-License-Identifier: GPL-3.0-or-later
"""Every exporter of Blender writes splashes, drops and models, and nothing of what they store."""

import re
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from scipy.spatial import cKDTree

from liquid_splash_addon.blender.data import stored_liquid
from liquid_splash_addon.blender.jobs import loaded_generator
from tests.blender import reading
from tests.blender.exporting import DEFAULT, EXPORTERS, WITH, WITHOUT, export
from tests.blender.modelling import ThickTubes, crossing, generate_layers
from tests.blender.sketching import add_sketch, evaluated_mesh, fan, generate
from tests.blender.test_old_files import BEFORE_ROOMS

ARCHIVES = {"Alembic": ".abc", "USD": ".usdc"}
READERS = {"glTF": reading.gltf, "FBX": reading.fbx, "OBJ": reading.obj, "PLY": reading.ply,
           "STL": reading.stl}  # fmt: skip
NO_LOOSE_VERTICES = {"glTF", "STL"}
"""Formats, or exporters by default, that leave out what is in no face."""

OWN_SPACE = {"glTF", "FBX"}
"""Formats whose vertices are in the space of their object."""

Y_UP = {"Alembic", "glTF", "OBJ"}
"""Exporters that turn vectors; FBX turns the objects instead."""

DIGITS = 2e-6
"""To which OBJ files are written, Blender units."""

WAYS = [
    (name, custom)
    for name, exporter in EXPORTERS.items()
    for custom in ((DEFAULT,) if exporter.custom is None else (DEFAULT, WITH, WITHOUT))
]

SECRETS = (b"splash_liquid", stored_liquid.OLD_PROPERTY.encode())
"""Names under which liquid is, or was, stored."""


class Saved(NamedTuple):
    """A file to export, and what is in it.

    Attributes
    ----------
    meshes : attributes of the points of each object as they should be exported, by its name
    contents : a piece of each stored liquid
    """

    path: Path
    meshes: dict[str, dict[str, np.ndarray]]
    contents: list[bytes]


def refine(splash: bpy.types.Object, **droplets: float) -> None:
    """Add droplets and waves to a splash, and its drops as points."""
    bpy.context.view_layer.objects.active = splash
    assert bpy.ops.splash.refinement_add(kind="DROPLETS") == {"FINISHED"}
    assert bpy.ops.splash.refinement_add(kind="WAVES") == {"FINISHED"}
    for name, value in droplets.items():
        setattr(splash.splash_stack.items[0].droplets, name, value)
    assert bpy.ops.splash.drop_points() == {"FINISHED"}


def piece(content: bytes) -> bytes:
    """Return some bytes of a stored liquid that are nowhere else."""
    return content[len(content) // 2 :][:32]


def attributes(item: bpy.types.Object) -> dict[str, np.ndarray]:
    """Return the attributes of an object's evaluated mesh, and the positions in the world."""
    found, matrix = evaluated_mesh(item), np.array(item.matrix_world)
    return {**found, "world": found["position"] @ matrix[:3, :3].T + matrix[:3, 3]}


def save(path: Path) -> Saved:
    """Save the open file and return what is in it."""
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    stored = [stored_liquid.read(mesh)[0] for mesh in bpy.data.meshes]
    shown = [item for item in bpy.context.scene.objects if item.type == "MESH"]
    return Saved(
        path,
        {item.name: attributes(item) for item in shown if not item.hide_render},
        [piece(content) for content in stored if content],
    )


@pytest.fixture(scope="module")
def saved(tmp_path_factory) -> Saved:
    """A splash with refinements and drops, and a model of two others."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loaded_generator, "get", lambda *_: ThickTubes())
        bpy.context.scene.splash.settings.resolution = "64"
        bpy.context.scene.frame_end = 2  # what has a modifier is exported for every frame
        add_sketch(fan(), Matrix.Translation((3, 0, 1)) @ Matrix.Rotation(0.5, 4, "Z"))
        refine(generate(), amount=0.03, flight=0.1, cohesion=0.4, spread=1.0)
        generate_layers(crossing())
        found = save(tmp_path_factory.mktemp("exported") / "splashes.blend")
    assert set(found.meshes) == {"Splash", "Splash Drops", "Splash Model"}
    assert all(len(mesh["velocity"]) > 3 for mesh in found.meshes.values())
    assert len(found.contents) == 3, "of one splash and of two parts"
    return found


def exported(name: str, saved: Saved, out: Path, custom: str = DEFAULT) -> Path:
    """Export a file and check that nothing of what is stored is in it."""
    exporter = EXPORTERS[name]
    if exporter.operator is None:
        pytest.skip(f"this Blender was built without {name}")
    path = export(name, saved.path, out, custom)
    data = path.read_bytes()
    if name in ARCHIVES:
        data += str(reading.archive(path)["text"]).encode()
    assert not [secret for secret in (*SECRETS, *saved.contents) if secret in data]
    return path


def meshes_of(path: Path) -> dict[str, dict[str, np.ndarray]]:
    """Return the attributes of each mesh of an archive by the name of its object.

    Blender writes an object once more for the point cloud that its modifier makes.
    """
    found: dict[str, dict[str, np.ndarray]] = {}
    for key, values in reading.archive(path).items():
        place, _, attribute = key.rpartition(":")
        if place and not re.search(r"Splash_Drops[-_]0", place):
            found.setdefault(place.split("/")[-2].replace("_", " "), {})[attribute] = values
    return found


def y_up(vectors: np.ndarray) -> np.ndarray:
    """Turn vectors from Blender's axes to those of Alembic, glTF and others."""
    return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)


@pytest.mark.parametrize(("name", "custom"), WAYS)
def test_nothing_that_is_stored_is_exported(name, custom, saved, tmp_path):
    assert exported(name, saved, tmp_path, custom).stat().st_size > 10_000


@pytest.mark.parametrize("name", ARCHIVES)
def test_archives_hold_vertices_and_velocities(name, saved, tmp_path):
    found = meshes_of(exported(name, saved, tmp_path))
    turned = y_up if name in Y_UP else np.asarray
    for label, mesh in saved.meshes.items():
        for attribute in ("position", "velocity"):
            np.testing.assert_array_equal(found[label][attribute], turned(mesh[attribute]))
        assert (len(found[label]["corners"]) == 0) == (label == "Splash Drops")
    if name == "USD":
        drops = saved.meshes["Splash Drops"]
        np.testing.assert_array_equal(found["Splash Drops"]["radius"], drops["radius"])


@pytest.mark.parametrize("name", ARCHIVES)
def test_archives_hold_the_ballistic_preview(name, tubes, tmp_path):
    scene = bpy.context.scene
    scene.frame_set(10)
    add_sketch(fan())
    splash = generate()
    still = evaluated_mesh(splash)["position"]
    bpy.ops.splash.ballistic_preview()
    scene.frame_start = scene.frame_end = 34
    scene.frame_set(34)
    flying = save(tmp_path / "flying.blend")
    assert np.abs(flying.meshes["Splash"]["position"] - still).max() > 0.05
    found = meshes_of(exported(name, flying, tmp_path))["Splash"]
    turned = y_up if name in Y_UP else np.asarray
    for attribute in ("position", "velocity"):
        np.testing.assert_array_equal(found[attribute], turned(flying.meshes["Splash"][attribute]))


@pytest.mark.parametrize("name", READERS)
def test_other_files_hold_the_vertices(name, saved, tmp_path):
    found = np.concatenate(READERS[name](exported(name, saved, tmp_path)))
    for label, mesh in saved.meshes.items():
        if label == "Splash Drops" and name in NO_LOOSE_VERTICES:
            continue
        wanted = mesh["position"] if name in OWN_SPACE else mesh["world"]
        away, _ = cKDTree(found).query(y_up(wanted) if name in Y_UP else wanted)
        assert away.max() < DIGITS, label


@pytest.mark.parametrize("name", EXPORTERS)
def test_a_file_from_before_liquid_was_stored_in_a_group(name, tmp_path):
    bpy.ops.wm.open_mainfile(filepath=str(BEFORE_ROOMS))
    splash = bpy.context.active_object
    label, mesh, content = splash.name, evaluated_mesh(splash), stored_liquid.read(splash.data)[0]
    path = exported(name, Saved(BEFORE_ROOMS, {label: mesh}, [piece(content)]), tmp_path)
    if name in ARCHIVES:
        velocity = y_up(mesh["velocity"]) if name in Y_UP else mesh["velocity"]
        np.testing.assert_array_equal(meshes_of(path)[label]["velocity"], velocity)
