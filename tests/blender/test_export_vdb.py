# SPDX-License-Identifier: GPL-3.0-or-later
"""An exported volume is the splash that is seen, where it stands, by readers that others wrote."""

import os
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector
from scipy.spatial import cKDTree

from liquid_splash_addon.blender.jobs.solver_start import compute_start, read_start
from liquid_splash_addon.blender.scene import openvdb
from liquid_splash_addon.blender.scene.objects import SceneError
from liquid_splash_addon.core.progress import silent
from tests.blender.modelling import crossing, generate_layers
from tests.blender.sketching import add_sketch, evaluated_mesh, fan, generate, in_world, vertices

pytestmark = pytest.mark.usefixtures("thick_drafts")

PLACE = Matrix.LocRotScale(Vector((-4, 2, 1)), Euler((2.9, 0.2, 0.8)), (-1.5, 1.5, 1.5))


@pytest.fixture
def splash() -> bpy.types.Object:
    """Return a splash that was turned, mirrored and enlarged."""
    add_sketch(fan())
    item = generate()
    item.matrix_world = PLACE
    bpy.context.view_layer.update()
    return item


def export(path: Path) -> Path:
    """Export the active object."""
    assert bpy.ops.splash.export_vdb(filepath=str(path)) == {"FINISHED"}
    return path


def cell_of(item: bpy.types.Object) -> float:
    """Return the edge of a cell in the world."""
    return compute_start(read_start(item), silent).cell


def test_the_surface_is_the_splash_by_blenders_own_reader(splash, tmp_path):
    path = export(tmp_path / "splash.vdb")
    volume = bpy.data.volumes.new("volume")
    volume.filepath = str(path)
    shown = bpy.data.objects.new("volume", bpy.data.meshes.new("from volume"))
    bpy.context.collection.objects.link(shown)
    reader = bpy.data.objects.new("reader", volume)
    bpy.context.collection.objects.link(reader)
    modifier = shown.modifiers.new("volume", "VOLUME_TO_MESH")
    modifier.object, modifier.grid_name, modifier.threshold = reader, "surface", 0.0
    bpy.context.view_layer.update()
    assert volume.grids.load()
    assert [grid.name for grid in volume.grids] == ["surface", "velocity"]
    found = evaluated_mesh(shown)["position"]
    cell = cell_of(splash)
    for one, other in ((found, in_world(splash)), (in_world(splash), found)):
        away, _ = cKDTree(other).query(one)
        assert len(one) > 1000 and np.quantile(away, 0.99) < 1.5 * cell


def test_the_distance_by_an_independent_reader(splash, tmp_path):
    tinyvdb = pytest.importorskip("tinyvdb", reason="its wheel is for Python 3.11 here")
    file = tinyvdb.open(str(export(tmp_path / "splash.vdb")))
    file.read_grids()
    grid = file.grid(0)
    assert file.grid_name(0) == "surface"
    sparse = grid.to_sparse()
    cells = np.frombuffer(sparse["coords"], dtype=np.int32).reshape(-1, 3)
    values = np.frombuffer(sparse["values"], dtype=np.float32)
    start = compute_start(read_start(splash), silent)
    distance = start.liquid.distance[tuple(cells.T)] * start.cell
    assert len(values) > 1000 and np.abs(values - distance).max() < 1e-5


def test_the_velocity_and_its_place(splash, tmp_path):
    module = openvdb.load_openvdb()
    grids = {grid.name: grid for grid in module.readAll(str(export(tmp_path / "a.vdb")))[0]}
    assert grids["surface"].gridClass == module.GridClass.LEVEL_SET
    accessor, transform = grids["velocity"].getConstAccessor(), grids["velocity"].transform
    points = in_world(splash)[::11]
    expected = (vertices(splash, "velocity") @ np.array(splash.matrix_world)[:3, :3].T)[::11]
    cells = [tuple(round(n) for n in transform.worldToIndex(tuple(map(float, point))))
             for point in points]  # fmt: skip
    found = np.array([accessor.getValue(cell) for cell in cells])
    error = np.linalg.norm(found - expected, axis=1)
    assert np.median(error) < 0.1 * np.median(np.linalg.norm(expected, axis=1))


def test_models_are_exported_too(tmp_path):
    model = generate_layers(crossing())
    bpy.context.view_layer.objects.active = model
    assert export(tmp_path / "model").with_suffix(".vdb").stat().st_size > 1000


def test_what_cannot_be_written_says_so(splash, tmp_path, monkeypatch):
    def refused(path):
        with pytest.raises(RuntimeError) as error:
            bpy.ops.splash.export_vdb(filepath=str(path))
        return str(error.value)

    assert "choose another" in refused(tmp_path / "nowhere" / "splash.vdb")
    (tmp_path / "folder.vdb").mkdir()
    assert "cannot be written" in refused(tmp_path / "folder.vdb")
    assert os.listdir(tmp_path) == ["folder.vdb"]
    monkeypatch.setattr(openvdb, "NAMES", ("no_such_module",))
    assert "This Blender has no OpenVDB" in refused(tmp_path / "splash.vdb")
    assert "Give a file" in refused("")


def test_blenders_own_folder_is_searched(monkeypatch):
    monkeypatch.setattr(openvdb, "bundled_packages", lambda: "/no/such/folder")
    monkeypatch.setitem(__import__("sys").modules, "openvdb", None)
    monkeypatch.setitem(__import__("sys").modules, "pyopenvdb", None)
    with pytest.raises(SceneError, match="no OpenVDB"):
        openvdb.load_openvdb()
