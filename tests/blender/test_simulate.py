# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulate Splash: frames beside the file, played by Blender's own nodes, never lost."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.jobs import estimates, loaded_generator, memory, simulate
from liquid_splash_addon.blender.scene import frame_folder, motion_object
from liquid_splash_addon.blender.ui import simulate_panel
from liquid_splash_addon.core.composition.drops import Drops
from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.playback.files import FILE, MANIFEST
from liquid_splash_addon.core.playback.playback import played
from liquid_splash_addon.core.playback.ply import ply_bytes
from liquid_splash_addon.core.progress import Cancelled
from tests.blender.drawing_panels import drawn
from tests.blender.modelling import crossing, generate_layers
from tests.blender.sketching import TubeGenerator, add_sketch, evaluated_mesh, fan, generate
from tests.blender.test_copies import duplicate
from tests.blender.test_drop_points import cloud

pytestmark = pytest.mark.once

ROOT = Path(__file__).resolve().parents[2]
FRAMES, START = 3, 5

PLAIN = """
import sys, bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[-1])
scene, item = bpy.context.scene, bpy.data.objects["Splash Motion"]
for frame in range(4, 10):
    scene.frame_set(frame)
    shown = item.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    print("vertices:", frame, len(shown.vertices), "velocity" in shown.attributes, flush=True)
import os; os._exit(0)
"""
"""Opens a file in a Blender without the add-on."""


def settings_of(splash: bpy.types.Object, **settings) -> None:
    """Make a simulation small, and as wanted."""
    record = splash.splash_simulation
    record.settings.frames, record.settings.resolution, record.start = FRAMES, "64", START
    for name, value in settings.items():
        setattr(record.settings, name, value)


def simulated(splash: bpy.types.Object) -> bpy.types.Object:
    """Press the button and return what plays the frames."""
    bpy.context.view_layer.objects.active = splash
    assert bpy.ops.splash.simulate() == {"FINISHED"}
    return splash.splash_simulation.motion


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A file with a splash that was simulated."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    path = tmp_path_factory.mktemp("simulated") / "splash.blend"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loaded_generator, "get", lambda *_: TubeGenerator())
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        add_sketch(fan())
        splash = generate()
        settings_of(splash, gravity=False)
        simulated(splash)
        bpy.ops.wm.save_mainfile()
    return path


@pytest.fixture
def splash(made, tmp_path) -> bpy.types.Object:
    """Open a copy of that file in a folder of its own and return the splash."""
    shutil.copytree(made.parent, tmp_path / "project")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "project" / made.name))
    return bpy.data.objects["Splash"]


@pytest.fixture
def fresh(tubes, tmp_path) -> bpy.types.Object:
    """Return a splash of a saved file, as yet not simulated."""
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "fresh.blend"))
    add_sketch(fan())
    splash = generate()
    settings_of(splash)
    return splash


def files(splash: bpy.types.Object) -> list[bytes]:
    """Return the files that are played."""
    folder = frame_folder.folder_of(splash)
    return [(folder / FILE.format(number=n)).read_bytes() for n in range(played(folder))]


def read(content: bytes) -> np.ndarray:
    """Return the vertices of a file: positions, velocities, radii, ``(n, 7)``."""
    head, body = content.split(b"end_header\n", 1)
    count = int(head.split(b"element vertex ")[1].split()[0])
    return np.frombuffer(body, "<f4", 7 * count).reshape(-1, 7)


def shown(item: bpy.types.Object, frame: int) -> dict[str, np.ndarray]:
    """Return what an object shows at a frame."""
    bpy.context.scene.frame_set(frame)
    return evaluated_mesh(item)


def test_frames_play_on_the_timeline(splash):
    motion, stored = splash.splash_simulation.motion, [read(data) for data in files(splash)]
    assert len(stored) == FRAMES + 1 and len({len(values) for values in stored}) > 1
    for frame in range(START - 2, START + FRAMES + 3):
        found = shown(motion, frame)
        wanted = stored[min(max(frame - START, 0), FRAMES)]
        is_drop = wanted[:, 6] > 0
        np.testing.assert_array_equal(found["position"], wanted[~is_drop, :3])
        np.testing.assert_array_equal(found["velocity"], wanted[~is_drop, 3:6])
        found = shown(splash.splash_simulation.drops, frame)
        np.testing.assert_array_equal(found["position"], wanted[is_drop, :3])


def test_drops_are_points_beside_the_liquid(splash):
    """Exporters would write the liquid twice if it had points beside it."""
    record, folder = splash.splash_simulation, frame_folder.folder_of(splash)
    corner = np.eye(3, dtype=np.float32)
    liquid = Mesh(corner, np.array([[0, 1, 2]], dtype=np.int32), 2 * corner)
    drops = Drops(corner + 3, 4 * corner, np.float32([0.1, 0.2, 0.3]), np.array([0, 0, 1], bool))
    (folder / FILE.format(number=1)).write_bytes(ply_bytes(liquid, drops))
    found = shown(record.motion, START + 1)
    np.testing.assert_array_equal(found["position"], corner)
    points, radii, velocities = cloud(record.drops)
    np.testing.assert_array_equal(points, corner[:2] + 3)
    np.testing.assert_array_equal(radii, drops.radii[:2])
    np.testing.assert_array_equal(velocities, 4 * corner[:2])
    assert len(cloud(record.motion)[0]) == 0
    found = shown(record.drops, START + 1)
    np.testing.assert_array_equal(found["radius"], drops.radii[:2])
    np.testing.assert_array_equal(found["velocity"], 4 * corner[:2])


def test_velocities_are_in_units_per_second_of_the_scene(splash):
    """Without gravity the liquid moves on, from frame to frame, as its velocities say."""
    motion = splash.splash_simulation.motion
    first, last = (shown(motion, START + n) for n in (0, FRAMES))
    seconds = FRAMES / bpy.context.scene.render.fps
    moved = last["position"].mean(axis=0) - first["position"].mean(axis=0)
    expected = seconds * (first["velocity"] + last["velocity"].mean(axis=0)).mean(axis=0) / 2
    assert moved[0] > 0.02 and moved[0] == pytest.approx(expected[0], rel=0.2)


def test_the_first_frame_is_the_splash(splash):
    from scipy.spatial import cKDTree

    still = evaluated_mesh(splash)["position"]
    first = shown(splash.splash_simulation.motion, START)["position"]
    cell = np.ptp(still, axis=0).max() / 64
    for one, other in ((still, first), (first, still)):
        assert cKDTree(one).query(other)[0].mean() < 0.75 * cell, "half a cell and half an edge"


def test_a_blender_without_the_add_on_plays_and_moves_with_its_folder(splash, tmp_path):
    moved = tmp_path / "moved" / "deeper"
    shutil.move(tmp_path / "project", moved)
    command = [sys.executable, "-c", PLAIN]
    if not bpy.app.module:
        script = tmp_path / "plain.py"
        script.write_text(PLAIN)
        command = [bpy.app.binary_path, "-b", "--factory-startup", "--python", str(script), "--"]
    done = subprocess.run(
        [*command, str(moved / "splash.blend")], capture_output=True, text=True, timeout=600
    )
    lines = [line.split()[1:] for line in done.stdout.splitlines() if line.startswith("vertices:")]
    counts = [len(read((path).read_bytes())) for path in sorted(moved.rglob("*.ply"))]
    assert [int(line[1]) for line in lines] == [counts[0], *counts, counts[-1]], done.stderr
    assert all(line[2] == "True" for line in lines)


def test_a_file_saved_elsewhere_goes_on_playing(splash, tmp_path):
    before = splash.splash_simulation.folder
    (tmp_path / "other").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "copy.blend"), copy=True)
    assert splash.splash_simulation.folder == before, "the open file is where it was"
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "copy.blend"))
    count = len(shown(bpy.data.objects["Splash Motion"], START)["position"])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "other" / "as.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "other" / "as.blend"))
    splash = bpy.data.objects["Splash"]
    assert len(shown(splash.splash_simulation.motion, START)["position"]) == count > 0
    assert splash.splash_simulation.folder.startswith("//")
    before = files(splash)
    splash.splash_simulation.settings.frames = 1
    simulated(splash)
    assert splash.splash_simulation.folder.startswith("//splash_cache"), "its own, beside it"
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "project" / "splash.blend"))
    assert files(bpy.data.objects["Splash"]) == before, "the other file's frames are there"


def test_a_copy_gets_a_folder_when_it_is_simulated(splash):
    copy = duplicate(splash)
    assert copy.splash_simulation.folder == splash.splash_simulation.folder
    before = files(splash)
    copy.splash_simulation.settings.frames = 1
    motion = simulated(copy)
    assert motion not in (None, splash.splash_simulation.motion)
    assert copy.splash_simulation.folder != splash.splash_simulation.folder
    assert files(splash) == before and len(files(copy)) == 2
    assert motion_object.players_of(splash)[0] == splash.splash_simulation.motion


def test_what_was_stopped_goes_on(fresh):
    """Killed after a frame, then resumed, it ends in the files of a run that was never stopped."""
    # So many that it cannot be over before it is stopped.
    frames = fresh.splash_simulation.settings.frames = 12
    order = simulate.read_order(bpy.context, fresh)
    run = simulate.Run(order)

    def stop_later(_stage: str, _share: float) -> None:
        if run.played:
            raise Cancelled

    with pytest.raises(Cancelled):
        simulate.simulate(run, stop_later)
    simulate.write(run)
    record = fresh.splash_simulation
    done = len(files(fresh))
    assert 1 <= done == record.frames <= frames
    assert len(shown(record.motion, START)["position"])
    label = simulate_panel.label_of(fresh, bpy.context.scene)
    assert label == f"Resume after Frame {done - 1} of {frames}"
    simulated(fresh)
    resumed = files(fresh)
    assert len(resumed) == frames + 1 == record.frames
    assert bpy.ops.splash.simulation_delete() == {"FINISHED"}
    assert not record.folder and record.motion is None
    simulated(fresh)
    assert files(fresh) == resumed


def test_deleted_frames_are_missed_and_made_again(splash):
    before = files(splash)
    shutil.rmtree(frame_folder.folder_of(splash))
    bpy.context.view_layer.objects.active = splash
    assert "any more: make them again" in drawn(simulate_panel.SPLASH_PT_simulation)
    simulated(splash)
    assert files(splash) == before
    assert "any more" not in drawn(simulate_panel.SPLASH_PT_simulation)


def test_a_change_is_said_to_be_out_of_date(splash):
    bpy.context.view_layer.objects.active = splash
    assert "Out of date" not in drawn(simulate_panel.SPLASH_PT_simulation)
    splash.splash_simulation.settings.tension = True
    said = drawn(simulate_panel.SPLASH_PT_simulation)
    assert "Out of date" in said and "Simulate Again" in said


def test_an_unsaved_file_keeps_frames_for_later(tubes, tmp_path, monkeypatch):
    monkeypatch.setattr(frame_folder, "unsaved_folder", lambda: tmp_path / "temporary")
    add_sketch(fan())
    splash = generate()
    settings_of(splash, frames=1)
    assert "temporary folder" in drawn(simulate_panel.SPLASH_PT_simulation)
    motion = simulated(splash)
    before = files(splash)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert bpy.ops.splash.simulation_keep() == {"FINISHED"}
    assert splash.splash_simulation.folder.startswith("//splash_cache/")
    assert files(splash) == before and len(shown(motion, START)["position"])
    assert not any((tmp_path / "temporary").iterdir())


def test_what_cannot_be_written_is_said_first(fresh, tmp_path, monkeypatch):
    (tmp_path / "splash_cache").write_text("in the way")
    with pytest.raises(RuntimeError, match="save the file in a folder that can be written to"):
        bpy.ops.splash.simulate()
    (tmp_path / "splash_cache").unlink()
    with monkeypatch.context() as patch:
        patch.setattr(frame_folder, "free_bytes", lambda folder: 1000)
        with pytest.raises(RuntimeError, match="make room"):
            bpy.ops.splash.simulate()
    with monkeypatch.context() as patch:
        patch.setattr(memory, "total_bytes", lambda: 1e6)
        with pytest.raises(RuntimeError, match="lower Resolution or Margin"):
            bpy.ops.splash.simulate()
    assert not fresh.splash_simulation.folder and fresh.splash_simulation.motion is None


def test_a_process_that_fails_is_a_sentence(fresh, monkeypatch):
    monkeypatch.setattr(simulate, "MODULE", ".core.nowhere")
    with pytest.raises(RuntimeError, match=r"ModuleNotFoundError: .*nowhere"):
        bpy.ops.splash.simulate()
    monkeypatch.undo()


def test_liquid_that_left_the_domain_is_warned_of(splash):
    folder = frame_folder.folder_of(splash)
    made = json.loads((folder / MANIFEST).read_text())
    (folder / MANIFEST).write_text(json.dumps({**made, "left": 0.25}))
    simulate.write(simulate.Run(simulate.read_order(bpy.context, splash)))
    assert "25% of the liquid has left the domain: raise Margin" in (
        splash.splash_simulation.warnings
    )


def test_the_estimate_is_a_sentence(fresh):
    order = simulate.read_order(bpy.context, fresh)
    text = estimates.compute(order, lambda stage, share: None)
    assert text.startswith("About ") and "of memory" in text and "on disk" in text
    assert [estimates.size(n) for n in (1e3, 334e6, 2.34e9)] == ["1 MB", "330 MB", "2.3 GB"]
    assert [estimates.duration(s) for s in (0, 75, 125, 9000)] == [
        "1 s",
        "75 s",
        "2.1 min",
        "2.5 h",
    ]


def test_nothing_to_simulate_is_said():
    assert not bpy.ops.splash.simulate.poll()
    cube = bpy.data.objects.new("Cube", bpy.data.meshes.new("Cube"))
    bpy.context.scene.collection.objects.link(cube)
    bpy.context.view_layer.objects.active = cube
    assert not bpy.ops.splash.simulate.poll()
    assert not cube.is_property_set("splash_simulation")


def test_a_linked_splash_says_what_to_do(splash):
    path = bpy.data.filepath
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, into):
        into.objects = ["Splash", "Splash Motion"]
    for item in into.objects:
        bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.objects.active = into.objects[0]
    with pytest.raises(RuntimeError, match="make it local first"):
        bpy.ops.splash.simulate()
    assert len(shown(into.objects[1], START)["position"]), "it plays from beside its own file"


def test_one_bad_splash_does_not_keep_the_others(fresh, monkeypatch):
    copy = duplicate(fresh)
    fresh.splash.frame = ""  # as if it had never been made
    fresh.select_set(True)
    copy.splash_simulation.settings.frames = 1
    assert bpy.ops.splash.simulate() == {"FINISHED"}
    assert len(files(copy)) == 2 and not fresh.splash_simulation.folder


def test_a_model_moves_as_one(thick_drafts, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "model.blend"))
    model = generate_layers(crossing())
    settings_of(model, frames=1)
    model.splash_model.use_waves = True
    motion = simulated(model)
    first = shown(motion, START)["position"]
    still = evaluated_mesh(model)["position"]
    assert np.abs(np.sort([*first.min(0), *first.max(0)])
                  - np.sort([*still.min(0), *still.max(0)])).max() < 0.05  # fmt: skip


def test_obstacles_are_read_at_every_frame_in_pieces(fresh, monkeypatch):
    """The scene stays at its frame, and nothing is left behind."""
    collection = bpy.data.collections.new("Obstacles")
    bpy.context.scene.collection.children.link(collection)
    bpy.ops.mesh.primitive_cube_add(size=0.2, location=(5, 0, 0))
    cube = bpy.context.active_object
    for frame, x in ((START, 5.0), (START + FRAMES, 8.0)):
        cube.location.x = x
        cube.keyframe_insert("location", frame=frame)
    collection.objects.link(cube)
    fresh.splash_obstacles.collection = collection
    bpy.context.scene.frame_set(1)
    run = simulate.Run(simulate.read_order(bpy.context, fresh))
    scenes, seen = len(bpy.data.scenes), []
    (moving,) = simulate.read_obstacles(run, lambda stage, share: seen.append(share))
    poses = moving.stacked()
    assert poses.shape == (FRAMES + 1, 8, 3) and len(seen) > FRAMES
    assert poses[0].mean(axis=0)[0] == pytest.approx(5) and poses[-1].mean(axis=0)[0] > 7.9
    assert len(bpy.data.scenes) == scenes and bpy.context.scene.frame_current == 1
