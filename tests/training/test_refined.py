# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands that measure refinements and surfaces on simulated frames."""

import json

import numpy as np
import pytest

pytest.importorskip("torch")

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.mesh.marching_cubes import level_surface
from training.data.items import split_of
from training.research import refined, surfaces
from training.simulation import simulate

GRID = Grid((32, 32, 32), 0.01, (-0.16, -0.16, -0.16))


def ball_mesh(radius=0.1):
    distance = (np.linalg.norm(GRID.centres(), axis=-1) - radius) / GRID.spacing
    return level_surface(distance.astype(np.float32), np.zeros((3, *GRID.shape)), GRID), distance


def test_a_mesh_encloses_the_cells_of_its_liquid():
    mesh, distance = ball_mesh()
    enclosed = refined.enclosed_cells(mesh, GRID)
    clear = np.abs(distance) > 0.15
    np.testing.assert_array_equal(enclosed[clear], (distance < 0)[clear])


def test_crossing_faces_are_counted():
    mesh, _ = ball_mesh()
    assert surfaces.crossing_faces(mesh) == 0
    shifted = mesh.joined(mesh.__class__(mesh.vertices + 0.05, mesh.faces, mesh.velocities))
    assert 0.01 < surfaces.crossing_faces(shifted) < 0.5


def test_refined_command(run_command, toy_data, tmp_path, capsys):
    out = tmp_path / "refined.json"
    assert run_command(refined.main, toy_data, "--most", 1, "--out", out) == 0
    figures = json.loads(out.read_text())
    assert set(figures) == {"about", *refined.REFINEMENTS}
    assert figures["before"]["volume"] == 0
    assert figures["droplets"]["volume"] > 0
    assert abs(figures["after"]["iou"] - figures["before"]["iou"]) < 0.2
    assert "after" in capsys.readouterr().out


def test_surfaces_command(run_command, toy_data, tmp_path):
    out = tmp_path / "surfaces.json"
    assert run_command(surfaces.main, toy_data, "--most", 2, "--out", out) == 0
    figures = json.loads(out.read_text())
    assert 0 < figures["distance"] < 0.25
    assert figures["worst_crossing"] == 0
    assert figures["worst_crossing_waves"] < 0.001


@pytest.mark.parametrize("command", [refined.main, surfaces.main])
def test_no_data_is_an_error_with_advice(run_command, tmp_path, capsys, command):
    assert run_command(command, tmp_path) == 1
    assert "python -m training simulate" in capsys.readouterr().err


def test_one_split_is_simulated_alone(run_command, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(simulate, "simulate_scene", lambda seed, *_: asked.append(seed) or b"")
    monkeypatch.setattr(
        simulate, "run_everywhere",
        lambda work, seeds, options, **_: ((seed, work(seed, *options), None) for seed in seeds),
    )  # fmt: skip
    run_command(simulate.main, "--scenes", 60, "--split", "test", "--out", tmp_path)
    assert asked == [seed for seed in range(60) if split_of(seed) == "test"]
