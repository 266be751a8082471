# SPDX-License-Identifier: GPL-3.0-or-later
"""A simulation's folder: whole frames, resumed exactly, and what can go wrong."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from liquid_splash_addon.core.mesh.closest_point import nearest_on_mesh
from liquid_splash_addon.core.progress import Cancelled
from liquid_splash_addon.core.simulation.frames import (
    frame_path,
    frames_done,
    read_frame,
    read_manifest,
    write_saying,
)
from liquid_splash_addon.core.simulation.process import read_job, work, write_job
from liquid_splash_addon.core.simulation.run import particles_path, run, run_key
from liquid_splash_addon.core.simulation.settings import SimulationSettings
from liquid_splash_addon.core.simulation.start import LooseDrops, Start
from tests.core.simulation import starts
from tests.core.solids import is_closed, sphere

ROOT = Path(__file__).resolve().parents[3]
SETTINGS = SimulationSettings(frames=5, resolution="64", ground="FLOOR", margin=1.0)


@pytest.fixture(scope="module")
def begun() -> Start:
    """Return a crown above a floor and a ball that moves into it."""
    vertices, faces = sphere(0.02, (0, 0, 0), rings=16)
    drops = np.array([[0.0, 0.0, 0.05]], np.float32)
    return starts.start(
        starts.crown(1.5), ground=-0.08, up=np.array([0.1, 0.0, 1.0]),
        obstacles=(starts.moving(vertices, faces, (0.004, 0, 0), 5),),
        drops=LooseDrops(drops, drops, np.array([0.002], np.float32)),
    )  # fmt: skip


@pytest.fixture(scope="module")
def whole(begun, tmp_path_factory) -> Path:
    """Return the folder of a run that was never stopped."""
    folder = tmp_path_factory.mktemp("whole")
    assert run(begun, SETTINGS, folder) == 6
    return folder


def same(one: Path, other: Path, count: int = 6) -> bool:
    """Tell whether two folders hold the same frames and the same last particles, bit for bit."""
    paths = [frame_path(one, index) for index in range(count)] + [particles_path(one, count - 1)]
    for path in paths:
        with np.load(path) as here, np.load(other / path.name) as there:
            if not all(np.array_equal(here[name], there[name]) for name in here.files):
                return False
    return True


def test_frames_are_closed_meshes_that_move(whole):
    assert frames_done(whole) == 6
    first, last = read_frame(whole, 0), read_frame(whole, 5)
    assert is_closed(first.mesh.faces) and is_closed(last.mesh.faces)
    assert last.mesh.vertices.dtype == last.mesh.velocities.dtype == np.float32
    assert last.mesh.vertices[:, 2].max() > first.mesh.vertices[:, 2].max() + 0.01
    assert last.left < 0.03
    assert [path.name for path in whole.glob("particles_*")] == ["particles_00005.npz"]


def test_the_surface_flows_and_does_not_boil(whole):
    manifest = read_manifest(whole)
    for index in range(5):
        frame, after = read_frame(whole, index), read_frame(whole, index + 1)
        carried = frame.mesh.vertices + manifest["frame_seconds"] * frame.mesh.velocities
        triangles = after.mesh.vertices[after.mesh.faces].astype(np.float64)
        apart, _, _ = nearest_on_mesh(triangles, carried.astype(np.float64), 0.05)
        assert apart.mean() < 0.15 * manifest["cell"]


def test_a_stopped_run_goes_on_bit_for_bit(begun, whole, tmp_path):
    def stop(stage, share):
        if stage.startswith("Frame 3"):
            raise Cancelled

    with pytest.raises(Cancelled):
        run(begun, SETTINGS, tmp_path, stop)
    assert frames_done(tmp_path) == 3
    frame_path(tmp_path, 3).with_suffix(".npz.1.part").write_bytes(b"half")
    stages = []
    assert run(begun, SETTINGS, tmp_path, lambda stage, share: stages.append(stage)) == 6
    assert "Frame 2 of 5" not in stages and "Frame 3 of 5" in stages
    assert same(whole, tmp_path)


def test_more_frames_continue_and_another_start_begins_anew(begun, whole, tmp_path):
    assert run(begun, replace(SETTINGS, frames=2), tmp_path) == 3
    written = frame_path(tmp_path, 2).stat().st_mtime_ns
    assert run(begun, SETTINGS, tmp_path) == 6
    assert frame_path(tmp_path, 2).stat().st_mtime_ns == written and same(whole, tmp_path)
    (tmp_path / "mine.txt").write_text("stays")
    other = replace(SETTINGS, frames=1, gravity=False)
    assert run(begun, other, tmp_path) == 2
    assert (tmp_path / "mine.txt").exists() and frames_done(tmp_path) == 2
    assert read_manifest(tmp_path)["key"] == run_key(begun, other)


def test_a_damaged_last_frame_is_made_again(begun, whole, tmp_path):
    run(begun, replace(SETTINGS, frames=3), tmp_path)
    particles_path(tmp_path, 3).write_bytes(b"nothing")
    assert run(begun, SETTINGS, tmp_path) == 6
    assert same(whole, tmp_path)
    frame_path(tmp_path, 1).write_bytes(b"nothing")
    with pytest.raises(ValueError, match="damaged"):
        read_frame(tmp_path, 1)
    with pytest.raises(OSError, match="not in"):
        read_frame(tmp_path, 9)


def test_the_key_is_of_everything_but_the_number_of_frames(begun):
    key = run_key(begun, SETTINGS)
    assert run_key(begun, replace(SETTINGS, frames=9)) == key
    assert run_key(begun, replace(SETTINGS, margin=0.9)) != key
    assert run_key(replace(begun, frame_seconds=0.004), SETTINGS) != key
    assert run_key(replace(begun, obstacles=()), SETTINGS) != key
    assert run_key(Start.from_arrays(begun.to_arrays()), SETTINGS) == key


def test_a_folder_that_cannot_be_written_gets_a_sentence(begun, tmp_path):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(OSError, match="folder that can be written to"):
        run(begun, SETTINGS, tmp_path / "file" / "inside")
    said = []
    write_job(tmp_path / "job.npz", begun, SETTINGS, str(tmp_path / "file" / "inside"))
    assert work(tmp_path / "job.npz", lambda **values: said.append(values)) == 1
    assert "make room" in said[-1]["failed"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="Linux has a disk that is full")
def test_a_full_disk_gets_a_sentence(monkeypatch, tmp_path):
    real = Path.write_bytes
    monkeypatch.setattr(Path, "write_bytes", lambda path, data: real(Path("/dev/full"), data))
    with pytest.raises(OSError, match="make room"):
        write_saying(tmp_path / "frame", b"data" * 10_000)
    assert not list(tmp_path.iterdir())


def test_a_process_that_is_killed_goes_on(begun, whole, tmp_path):
    folder = tmp_path / "frames"
    write_job(tmp_path / "job.npz", begun, SETTINGS, str(folder))
    assert read_job(tmp_path / "job.npz")[1:] == (SETTINGS, str(folder))
    command = [
        sys.executable, "-m", "liquid_splash_addon.core.simulation.process",
        str(tmp_path / "job.npz"),
    ]  # fmt: skip
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "cwd": ROOT}
    with subprocess.Popen(command, **pipes) as process:
        for line in process.stdout:
            if json.loads(line).get("frames", 0) >= 2:
                break
        process.send_signal(signal.SIGKILL if hasattr(signal, "SIGKILL") else signal.SIGTERM)
    assert 2 <= frames_done(folder) < 6
    with subprocess.Popen(command, **pipes) as process:
        lines = [json.loads(line) for line in process.stdout]
        assert process.wait() == 0
    assert lines[-1] == {"done": 6}
    shares = [line["share"] for line in lines[:-1]]
    assert shares == sorted(shares)
    assert same(whole, folder)


def test_a_job_that_is_none_gets_a_sentence(tmp_path):
    (tmp_path / "job.npz").write_bytes(b"nothing")
    said = []
    assert work(tmp_path / "job.npz", lambda **values: said.append(values)) == 1
    assert "simulate again" in said[0]["failed"]
