# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames on disk, strokes drawn from them, and the pairs that the network sees."""

from pathlib import Path

import numpy as np
import pytest

from liquid_splash_addon.core.alignment import fit_frame
from liquid_splash_addon.core.fields import AIR
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.pipeline import Cancelled, make_splash
from liquid_splash_addon.core.settings import SplashSettings
from training.dataset import (
    augmented_frame,
    draw_strokes,
    held_out_sample,
    load_items,
    sample_on,
    split_of,
    training_sample,
)
from training.frames import load_scene, make_frame, save_scene
from training.prepare import lines_path
from training.simulate import main as simulate_main


def test_frames_come_back_from_disk(tmp_path: Path):
    rng = np.random.default_rng(0)
    distance = rng.uniform(-4, 6, (8, 10, 12))
    velocity = np.tile(np.float32([1.0, -2.0, 0.5]), (8, 10, 12, 1))
    frame = make_frame(distance, velocity, np.array([3, 4, 5]), 0.1)
    save_scene(tmp_path / "scene_000001.npz", {"seed": 1, "frames": 1}, [frame])
    parameters, (again,) = load_scene(tmp_path / "scene_000001.npz")
    assert parameters["seed"] == 1
    assert np.abs(again.distance_cells() - np.clip(distance, -3, 3)).max() <= 3 / 254 + 1e-6
    assert again.start.tolist() == [3, 4, 5] and again.time == pytest.approx(0.1)
    dense = again.dense_velocity()
    assert np.allclose(dense[dense.any(-1)], [1.0, -2.0, 0.5])
    assert not list(tmp_path.glob("*.tmp"))


def test_splits_are_fixed_and_about_a_tenth():
    splits = [split_of(seed) for seed in range(2000)]
    assert splits[:6] == [split_of(seed) for seed in range(6)]
    for name in ("test", "validation"):
        assert splits.count(name) / 2000 == pytest.approx(0.1, abs=0.03)


def test_no_scene_is_in_two_splits(toy_data: Path):
    scenes = [{i.scene for i in load_items(toy_data, s)} for s in ("train", "validation", "test")]
    assert all(scenes) and not (
        scenes[0] & scenes[1] or scenes[1] & scenes[2] or scenes[0] & scenes[2]
    )


def test_missing_data_says_what_to_run(tmp_path: Path):
    with pytest.raises(ValueError, match=r"training\.simulate"):
        load_items(tmp_path, "train")


def test_strokes_follow_the_flow(toy_data: Path):
    item = load_items(toy_data, "train")[0]
    strokes = draw_strokes(item.lines, np.random.default_rng(0), (5, 20), jitter=False)
    assert 5 <= len(strokes) <= 20
    for stroke in strokes:
        steps = np.diff(stroke.points, axis=0)
        along = (steps * stroke.velocities[:-1]).sum(1) / (
            np.linalg.norm(steps, axis=1) * np.linalg.norm(stroke.velocities[:-1], axis=1) + 1e-9
        )
        assert np.median(along) > 0.9


class Recorder:
    """Stands where the generator does, keeps the condition it is given, and stops there."""

    config = None

    def generate(self, condition, grid, latent):
        self.condition, self.grid = condition, grid
        raise Cancelled


@pytest.mark.parametrize("cells", [64, 128])
def test_both_paths_give_the_same_condition_to_the_bit(toy_data: Path, cells: int):
    """What training shows the network for some Strokes is what the add-on shows it."""
    item = load_items(toy_data, "train")[0]
    strokes = draw_strokes(item.lines, np.random.default_rng(1), (5, 20), jitter=True)
    settings = SplashSettings(real_size=0.0, speed_gain=1.0, resolution=str(cells))
    recorder = Recorder()
    with pytest.raises(Cancelled):
        make_splash(strokes, settings, recorder)
    assert recorder.grid == Grid.local(cells)
    sample = sample_on(item, strokes, fit_frame(strokes), recorder.grid)
    assert sample.condition.tobytes() == recorder.condition.tobytes()
    assert sample.condition.any()


def test_strokes_lie_in_the_liquid_of_their_sample(toy_data: Path):
    for item in load_items(toy_data, "train"):
        sample, _ = held_out_sample(item, 64)
        crossed = sample.condition[0] > 0
        assert np.median(sample.distance[crossed]) < 0
        assert (sample.distance[crossed] < 1.5).mean() > 0.95
        wet = crossed & (sample.distance < 0)
        drawn, there = sample.condition[1:, wet], sample.velocity[:, wet]
        cosine = (drawn * there).sum(0) / (
            np.linalg.norm(drawn, axis=0) * np.linalg.norm(there, axis=0)
        )
        assert np.median(cosine) > 0.95


def test_distance_does_not_depend_on_the_frame(toy_data: Path):
    """Turned frames see the same liquid: volumes agree, cells are in cells of the new grid."""
    item = load_items(toy_data, "train")[0]
    strokes = draw_strokes(item.lines, np.random.default_rng(1), (5, 20), jitter=False)
    rng = np.random.default_rng(0)
    volumes = []
    for _ in range(3):
        frame = augmented_frame(fit_frame(strokes), strokes, rng)
        volumes.append((sample_on(item, strokes, frame, Grid.local(64)).distance < 0).sum())
    assert np.ptp(volumes) < 0.1 * np.mean(volumes)


def test_training_samples_are_drawn_anew_and_in_range(toy_data: Path):
    item = load_items(toy_data, "train")[0]
    rng = np.random.default_rng(0)
    for fine in (False, True):
        first, second = (training_sample(item, rng, fine, cells=32) for _ in range(2))
        assert first.condition.shape == (4, 32, 32, 32) and first.velocity.shape == (3, 32, 32, 32)
        assert np.abs(first.distance).max() <= AIR
        assert not np.array_equal(first.condition, second.condition)
        assert first.grid.spacing == pytest.approx(0.4 / 128 if fine else 0.4 / 32)


def test_simulate_goes_on_where_it_stopped(tmp_path: Path, run_command):
    arguments = (
        "--scenes",
        2,
        "--first",
        40,
        "--resolution",
        16,
        "--workers",
        1,
        "--out",
        tmp_path,
    )
    assert run_command(simulate_main, *arguments) == 0
    before = {path: path.stat().st_mtime_ns for path in tmp_path.glob("scene_*.npz")}
    assert len(before) == 2
    gone = sorted(before)[0]
    gone.unlink()
    assert run_command(simulate_main, *arguments) == 0
    after = {path: path.stat().st_mtime_ns for path in tmp_path.glob("scene_*.npz")}
    assert set(after) == set(before)
    assert [p for p in before if before[p] != after[p]] == [gone]


def test_simulate_says_where_it_cannot_write(tmp_path: Path, run_command, capsys):
    (tmp_path / "file").write_text("in the way")
    arguments = ("--scenes", 1, "--out", tmp_path / "file" / "data")
    assert run_command(simulate_main, *arguments) == 1
    assert "choose another --out" in capsys.readouterr().err


def test_lines_lie_beside_their_scene():
    assert lines_path(Path("d/scene_000012.npz")) == Path("d/lines_000012.npz")
