# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated frames become files that are played: the same however often they were interrupted."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.playback import process
from liquid_splash_addon.core.playback.files import FILE
from liquid_splash_addon.core.playback.flying_drops import FlyingDrops, Surroundings, advance
from liquid_splash_addon.core.playback.playback import Playback, Player, played
from liquid_splash_addon.core.playback.ply import ply_bytes
from liquid_splash_addon.core.refinement.settings import DropletSettings, WaveSettings
from liquid_splash_addon.core.scale import Scale
from liquid_splash_addon.core.simulation.frames import write_frame, write_manifest
from liquid_splash_addon.core.simulation.start import Frame, LooseDrops, MovingObstacle
from liquid_splash_addon.core.sketch.local_frame import Frame as LocalFrame
from tests.core.solids import box

CELL, STEP = 0.005, 1 / 480
DROPLETS = DropletSettings(amount=0.05, flight=4 * STEP, seed=3)
DOWN = Surroundings(np.array([0, 0, -9.81]), np.array([0, 0, 1.0]))
TURNED = LocalFrame(
    np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]), np.array([1.0, 2, 3]), Scale(0.25, 0.05)
)


def ball(radius=0.05, centre=(0.0, 0, 0), speed=(0.0, 0, 0), rings=24) -> Mesh:
    """Return a closed ball, of unit quads cut in two, that spreads and moves."""
    from skimage.measure import marching_cubes

    axes = np.linspace(-1.5, 1.5, rings)
    level = np.sqrt(sum(a**2 for a in np.meshgrid(axes, axes, axes, indexing="ij"))) - 1
    vertices, faces, _, _ = marching_cubes(level, 0.0, spacing=(axes[1] - axes[0],) * 3)
    unit = vertices - 1.5
    velocities = np.sin(40 * unit) + np.asarray(speed)
    return Mesh(
        (unit * radius + centre).astype(np.float32),
        np.ascontiguousarray(faces[:, ::-1], dtype=np.int32),
        velocities.astype(np.float32),
    )


def simulated(folder, count=6):
    """Write frames of a ball that falls, with two loose drops."""
    write_manifest(folder, {"key": "one", "frames": count - 1, "frame_seconds": STEP, "cell": CELL})
    drops = LooseDrops(
        *(np.full((2, 3), v, np.float32) for v in (0.2, 1.0)), np.full(2, 1e-3, "f4")
    )
    for number in range(count):
        mesh = ball(centre=(0, 0, -0.01 * number), speed=(0, 0, -1))
        write_frame(folder, number, Frame(mesh, drops))
    return folder


def shown(folder) -> list[bytes]:
    """Return the files to play."""
    return [(folder / FILE.format(number=n)).read_bytes() for n in range(played(folder))]


def playback(*steps) -> Playback:
    return Playback(TURNED, tuple(steps), DOWN)


def test_a_file_is_read_by_another_library(tmp_path):
    from pymeshlab import MeshSet

    mesh, drops = ball(), advance(FlyingDrops.none(), ball(), [DROPLETS], STEP, 1, CELL, DOWN)
    drops = drops._replace(ages=drops.growths).shown()
    path = tmp_path / "frame.ply"
    path.write_bytes(ply_bytes(mesh, drops))
    meshes = MeshSet()
    meshes.load_new_mesh(str(path))
    found = meshes.current_mesh()
    count = len(mesh.vertices)
    np.testing.assert_array_equal(found.vertex_matrix()[:count], mesh.vertices)
    np.testing.assert_array_equal(found.vertex_matrix()[count:], drops.positions)
    np.testing.assert_array_equal(found.face_matrix(), mesh.faces)
    assert len(drops.radii) > 0


def test_frames_are_in_the_units_of_the_scene(tmp_path):
    Player(simulated(tmp_path, 2), playback()).catch_up()
    values = np.frombuffer(shown(tmp_path)[1].split(b"end_header\n", 1)[1], dtype="<f4")
    wanted, count = ball(centre=(0, 0, -0.01), speed=(0, 0, -1)), len(ball().vertices)
    vertices = values[: 7 * count].reshape(-1, 7)
    np.testing.assert_allclose(
        vertices[:, :3], TURNED.points_to_drawing(wanted.vertices), atol=1e-6
    )
    half = wanted.velocities.astype(np.float16).astype(np.float32)  # as they are stored
    np.testing.assert_allclose(
        vertices[:, 3:6], TURNED.vectors_to_drawing(half), rtol=1e-5, atol=1e-7
    )
    assert not vertices[:, 6].any()
    assert np.allclose(TURNED.vectors_to_drawing(half), 0.05 / 0.25 * half @ TURNED.axes)
    np.testing.assert_allclose(values[7 * count :][:14].reshape(2, 7)[:, 6], 1e-3 / 0.25, rtol=1e-6)


@pytest.mark.parametrize("stopped", [1, 3])
def test_what_was_stopped_ends_in_the_same_files(tmp_path, stopped):
    how = playback(DROPLETS, WaveSettings())
    folders = [simulated(tmp_path / name, 5) for name in ("once", "twice")]
    for folder in folders:
        player = Player(folder, how)
        if folder == folders[1]:
            for _ in range(stopped):
                player.next()
            (folder / (FILE.format(number=stopped) + ".part")).write_bytes(b"half")
            player = Player(folder, how)
        assert player.catch_up() == 5
    assert shown(folders[0]) == shown(folders[1])


def test_other_refinements_make_the_files_anew(tmp_path):
    folder = simulated(tmp_path, 3)
    Player(folder, playback()).catch_up()
    bare = shown(folder)
    player = Player(folder, playback(WaveSettings()))
    player.next()
    assert played(folder) == 1, "those of before do not count"
    player.catch_up()
    assert len(shown(folder)) == 3 and shown(folder)[2] != bare[2]
    Player(folder, playback()).catch_up()
    assert shown(folder) == bare


def test_a_playback_comes_back_from_json():
    how = playback(DROPLETS, WaveSettings(amplitude=0.001))
    again = Playback.from_json(how.to_json())
    assert again.key({"key": 1}) == how.key({"key": 1}) != replace(how, steps=()).key({"key": 1})
    assert again.key({"key": 1}) != again.key({"key": 2})
    assert again.around.ground == -np.inf


def test_drops_fly_as_bodies_fall():
    drops, mesh = FlyingDrops.none(), ball()
    drops = advance(drops, mesh, [DROPLETS], STEP, 1, CELL, DOWN)
    count = len(drops.radii)
    assert count > 3
    born = drops
    for number in range(2, 30):
        drops = advance(drops, Mesh.empty(), (), STEP, number, CELL, DOWN)
    time = 28 * STEP
    wanted = born.positions + time * born.velocities + time**2 / 2 * DOWN.gravity
    np.testing.assert_allclose(drops.positions, wanted, atol=1e-5)
    np.testing.assert_allclose(drops.shown().radii, born.radii, rtol=1e-6)


def test_no_drop_flickers(tmp_path):
    """From frame to frame each is where its velocity takes it, and grows from nothing."""
    drops, before, seen = FlyingDrops.none(), None, 0
    for number in range(1, 12):
        mesh = ball(centre=(0, 0, 0.001 * number))
        after = advance(drops, mesh, [DROPLETS], STEP, number, CELL, DOWN)
        if before is not None and len(drops.radii):
            flown = drops.later(STEP, DOWN.gravity)
            kept = [bool((flown.positions == p).all(axis=1).any()) for p in after.positions]
            fresh = ~np.array(kept)
            assert not after.ages[fresh].any(), "what is not the same drop was just born"
            assert not after.shown().radii[fresh].any(), "and is still nothing"
        drops, before = after, drops
        seen += len(after.radii)
    assert seen > 10


def test_drops_that_are_there_from_the_start_fly_too(tmp_path):
    """As large as they are, until they meet something: here a box that comes in their way."""
    place = np.float32([[0.3, 0, 0], [-0.3, 0, 0]])
    drops = FlyingDrops.grown(place, np.zeros((2, 3), np.float32), np.float32([0.002, 0.003]))
    vertices, faces = box((0.25, -0.05, -0.05), (0.35, 0.05, 0.05))
    poses = np.stack([vertices + 1.0, vertices + 1.0, vertices]).astype(np.float32)
    folder = simulated(tmp_path, 4)
    how = replace(playback(), drops=drops)
    player = Player(folder, how, [MovingObstacle(poses, np.asarray(faces, np.int32))])
    counts = []
    for number in range(4):
        player.next()
        counts.append(len(player.drops.radii))
        assert np.float32(0.003 / 0.25).tobytes() in shown(folder)[number]
        faces_there = int(shown(folder)[number].split(b"element face ")[1].split()[0])
        assert faces_there == len(ball().faces), "too small for a surface"
    assert counts == [2, 2, 1, 1]
    fallen = player.drops.positions[0] - place[1]
    np.testing.assert_allclose(fallen, (3 * STEP) ** 2 / 2 * DOWN.gravity, atol=1e-6)
    again = Playback.from_json(how.to_json())
    assert again.key({}) == how.key({}) != playback().key({})


def test_drops_that_a_grid_could_hold_have_surfaces(tmp_path):
    drops = FlyingDrops.grown(
        np.float32([[0.3, 0, 0]]), np.zeros((1, 3), np.float32), np.float32([1.2 * CELL])
    )
    folder = simulated(tmp_path, 2)
    Player(folder, replace(playback(), drops=drops)).catch_up()
    for data in shown(folder):
        assert int(data.split(b"element face ")[1].split()[0]) == len(ball().faces) + 320
        assert np.float32(1.2 * CELL / 0.25).tobytes() not in data, "and are no points"


def test_drops_end_in_the_liquid_and_on_the_ground():
    inside, outside = np.float32([0, 0, 0.02]), np.float32([0, 0, 0.2])
    drops = FlyingDrops(
        np.stack([inside, outside, -outside]), np.zeros((3, 3), np.float32),
        *(np.full(3, value, np.float32) for value in (CELL, 1.0, 0.1)),
    )  # fmt: skip
    around = DOWN._replace(ground=-0.1)
    left = advance(drops, ball(), (), STEP, 1, CELL, around)
    assert len(left.radii) == 1 and left.positions[0, 2] > 0.19


def test_the_process_makes_what_is_there(tmp_path):
    folder = simulated(tmp_path / "frames", 3)
    job = tmp_path / "job.json"
    process.write_job(job, folder, playback(), None)
    said = []
    assert process.work(job, lambda **values: said.append(values)) == 0
    assert said == [{"done": 3, "played": 3, "warnings": []}]
    assert [len(a) > 1000 and a != b for a, b in pairwise(shown(folder))] == [True, True]


def test_a_damaged_frame_is_a_sentence(tmp_path):
    folder = simulated(tmp_path / "frames", 3)
    (folder / "frame_00001.npz").write_bytes(b"PK")
    process.write_job(tmp_path / "job.json", folder, playback(), None)
    said = []
    assert process.work(tmp_path / "job.json", lambda **values: said.append(values)) == 1
    assert "damaged: delete it" in said[-1]["failed"] and said[-1]["played"] == 1
