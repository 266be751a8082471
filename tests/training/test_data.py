# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames on disk, strokes drawn from them, and the pairs that the network sees."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from liquid_splash_addon.core.condition.channels import PATCH_CLOSENESS, STROKE_VELOCITY  # noqa: E402
from liquid_splash_addon.core.generator.generator import Generator  # noqa: E402
from liquid_splash_addon.core.generator.patch_classifier import load_patch_classifier  # noqa: E402
from liquid_splash_addon.core.generator.sparse import SparseCondition, halved  # noqa: E402
from liquid_splash_addon.core.grid import Grid  # noqa: E402
from liquid_splash_addon.core.liquid.fields import AIR  # noqa: E402
from liquid_splash_addon.core.pipeline import make_splash  # noqa: E402
from liquid_splash_addon.core.progress import Cancelled  # noqa: E402
from liquid_splash_addon.core.settings import SplashSettings  # noqa: E402
from liquid_splash_addon.core.sketch.local_frame import fit_frame  # noqa: E402
from training.data.frames import (  # noqa: E402
    StoredFrame,
    load_scene,
    near_blocks,
    pack_distance,
    pack_scene,
    pack_velocity,
    scene_path,
    seed_of,
    write_whole,
)
from training.data.items import load_items, split_of  # noqa: E402
from training.data.samples import augmented_frame, held_out_sample, samples_on  # noqa: E402
from training.data.sketching import draw_strokes, trace_frame  # noqa: E402
from training.data.stream import SampleSpecification, TrainingSamples, collate, stream  # noqa: E402

TOY = SampleSpecification(cells=32, crop=32)


@pytest.mark.parametrize("seed", [7, 999_999, 1_000_007, 123_456_789])
def test_seeds_of_any_length_are_read_back(seed, tmp_path):
    """Cut to six digits, a seed would lie in another split."""
    assert seed_of(scene_path(tmp_path, seed)) == seed


def made_up_frame(rng):
    """Return a frame with random distances and velocities, and what went into it."""
    distance = rng.uniform(-4, 6, (8, 10, 12))
    codes = pack_distance(distance)
    velocity = rng.normal(0, 3, (int(near_blocks(codes).sum()), 3))
    droplets = rng.normal(size=(3, 7)).astype(np.float16)
    frame = StoredFrame(codes, pack_velocity(velocity), np.array([3, 4, 5]), droplets, 0.1)
    return frame, distance, velocity


def test_frames_come_back_from_disk(tmp_path: Path):
    frame, distance, velocity = made_up_frame(np.random.default_rng(0))
    path = scene_path(tmp_path, 1)
    write_whole(path, pack_scene({"seed": 1}, [frame, frame]))
    parameters, (again, _) = load_scene(path)
    assert parameters == {"seed": 1, "times": [0.1, 0.1]}
    error = np.abs(again.signed_distance - np.clip(distance, -3, 3))
    assert error.max() <= 0.56 and error[np.abs(distance) < 0.6].max() < 0.051
    assert np.array_equal(again.signed_distance < 0, distance < 0)
    assert again.start.tolist() == [3, 4, 5] and again.time == pytest.approx(0.1)
    assert np.array_equal(again.droplets, frame.droplets)
    dense = again.block_velocity
    assert np.abs(dense[near_blocks(again.distance)] - velocity).max() < 0.026
    assert not dense[~near_blocks(again.distance)].any()
    assert not list(tmp_path.glob("*.tmp"))


def test_the_documented_lines_read_a_scene_without_the_project(tmp_path: Path):
    frame, distance, _ = made_up_frame(np.random.default_rng(0))
    write_whole(scene_path(tmp_path, 1), pack_scene({"seed": 1}, [frame]))
    text = (Path(__file__).parents[2] / "docs" / "data.md").read_text()
    lines = text.split("```python\n")[1].split("```")[0]
    assert sum(bool(line) for line in lines.splitlines()) == 5
    found: dict = {}
    exec(lines.replace("DATA/scene_000000.npz", str(scene_path(tmp_path, 1))), found)
    assert np.abs(found["distance"] - np.clip(distance, -3, 3)).max() < 0.56
    assert found["velocity"].shape == frame.velocity.shape


def test_a_damaged_file_does_not_load(tmp_path: Path):
    frame, _, _ = made_up_frame(np.random.default_rng(0))
    content = bytearray(pack_scene({"seed": 1}, [frame]))
    where = content.find(b"0/distance.npy") + 60
    content[where] ^= 0xFF
    write_whole(scene_path(tmp_path, 1), bytes(content))
    with pytest.raises((zipfile.BadZipFile, OSError, ValueError, EOFError)):
        load_scene(scene_path(tmp_path, 1))


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
    with pytest.raises(ValueError, match="python -m training simulate"):
        load_items(tmp_path, "train")


def strokes_of(item, seed, jitter):
    """Return strokes drawn for a frame."""
    rng = np.random.default_rng(seed)
    lines = trace_frame(item.load(), item.spacing, rng)
    return draw_strokes(lines, rng, (5, 20), jitter)


def test_strokes_follow_the_flow(toy_data: Path):
    item = load_items(toy_data, "train")[0]
    strokes = strokes_of(item, 0, jitter=False)
    assert 5 <= len(strokes) <= 20
    cosines = []
    for stroke in strokes:
        steps, flow = np.diff(stroke.points, axis=0), stroke.velocities[:-1]
        lengths = np.linalg.norm(steps, axis=1) * np.linalg.norm(flow, axis=1)
        cosines.append((steps * flow).sum(1) / (lengths + 1e-9))
    assert np.median(np.concatenate(cosines)) > 0.95


class Recorder(Generator):
    """The bundled generator without its network: it keeps what it is given, and stops there."""

    config = None

    def __init__(self):
        self.classifier = load_patch_classifier()

    def generate(self, condition, grid, latent):
        self.given, self.grid = condition, grid
        raise Cancelled


@pytest.mark.parametrize("cells", [64, 128])
def test_both_paths_give_the_same_condition_to_the_bit(toy_data: Path, cells: int):
    """What training shows the network for some Strokes is what the add-on shows it."""
    item = load_items(toy_data, "train")[0]
    strokes = strokes_of(item, 1, jitter=True)
    settings = SplashSettings(real_size=0.0, speed_gain=1.0, resolution=str(cells))
    recorder = Recorder()
    with pytest.raises(Cancelled):
        make_splash(strokes, settings, recorder)
    assert recorder.grid == Grid.local(cells)
    sample = samples_on(item.load(), item.spacing, strokes, fit_frame(strokes), [recorder.grid])[0]
    assert sample.condition.values.tobytes() == recorder.given.values.tobytes()
    assert sample.condition.where.tobytes() == recorder.given.where.tobytes()
    assert sample.condition.values[:, 0].any() and sample.condition.values[:, PATCH_CLOSENESS].any()


def test_strokes_lie_in_the_liquid_of_their_sample(toy_data: Path):
    for item in load_items(toy_data, "train"):
        sample, _ = held_out_sample(item, 64)
        crossed = sample.condition.drawn
        assert np.median(sample.distance[crossed]) < 0
        assert (sample.distance[crossed] < 1.5).mean() > 0.95
        wet = crossed & (sample.distance < 0)
        drawn, there = sample.condition.dense()[STROKE_VELOCITY, wet], sample.velocity[:, wet]
        cosine = (drawn * there).sum(0) / (
            np.linalg.norm(drawn, axis=0) * np.linalg.norm(there, axis=0)
        )
        assert np.median(cosine) > 0.95


def test_distance_does_not_depend_on_the_frame(toy_data: Path):
    """Turned frames see the same liquid: volumes agree, cells are in cells of the new grid."""
    item = load_items(toy_data, "train")[0]
    strokes = strokes_of(item, 1, jitter=False)
    rng = np.random.default_rng(0)
    volumes = []
    for _ in range(3):
        frame = augmented_frame(fit_frame(strokes), strokes, rng)
        sample = samples_on(item.load(), item.spacing, strokes, frame, [Grid.local(64)])[0]
        volumes.append((sample.distance < 0).sum())
    assert np.ptp(volumes) < 0.1 * np.mean(volumes)


def test_training_samples_are_drawn_anew_and_in_range(toy_data: Path):
    items = load_items(toy_data, "train")
    samples = TrainingSamples(items, TOY, seed=0)
    first, second = samples[0], samples[len(items)]
    for sample in (first, second):
        for part, spacing in ((sample.box, 0.4 / 32), (sample.part, 0.4 / 64)):
            assert part.condition.shape == (32, 32, 32) and part.condition.values.any()
            assert part.velocity.shape == (3, 32, 32, 32)
            assert np.abs(part.distance).max() <= AIR
            assert part.grid.spacing == pytest.approx(spacing)
    assert not np.array_equal(first.box.condition.where, second.box.condition.where)


def test_a_sample_is_the_same_whoever_draws_it(toy_data: Path):
    items = load_items(toy_data, "train")
    alone = stream(TrainingSamples(items, TOY, 0), 4, workers=0)
    first, second = next(alone), next(alone)
    later = next(stream(TrainingSamples(items, TOY, 0), 4, workers=1, first=4))
    halves = [next(stream(TrainingSamples(items, TOY, 0), 2, 0, 0, rank, 2)) for rank in (0, 1)]
    assert torch.equal(later.box.condition.dense(), second.box.condition.dense())
    assert torch.equal(later.detail.distance, second.detail.distance)
    whole = first.box.condition.dense()
    for rank in (0, 1):
        assert torch.equal(halves[rank].box.condition.dense(), whole[rank::2])


def test_the_part_is_where_the_sample_says(toy_data: Path):
    """Halved, the part's strokes and liquid are those of the box at the same place."""
    samples = TrainingSamples(load_items(toy_data, "train"), TOY, seed=3)
    for number in range(4):
        sample = samples[number]
        assert all(s % 4 == 0 for s in sample.start)
        here = tuple(slice(s // 2, s // 2 + 16) for s in sample.start)
        half = halved(SparseCondition.of(sample.part.condition)).dense()[0].numpy()
        seen = sample.box.condition.dense()[(slice(None), *here)]
        assert np.array_equal(seen[0], half[0])
        wet = (sample.part.distance < 0).reshape(16, 2, 16, 2, 16, 2).mean((1, 3, 5))
        box = sample.box.distance[here] < 0
        assert ((wet > 0.5) == box).mean() > 0.97


def test_obstacles_are_shown_where_they_are(toy_data: Path):
    """In the frame of a sketch turned at random, too: no liquid lies deep in an obstacle."""
    items = [i for i in load_items(toy_data, "train") if i.obstacle.shape != "none"]
    samples = TrainingSamples(items, SampleSpecification(64, 0, obstacle=1.0), seed=0)
    shown = 0
    for number in range(4):
        batch = collate([samples[number]])
        inside = batch.obstacle[0, 0] > 0.8  # 15 mm deep, a cell of the toy data
        shown += int((batch.obstacle > 0.5).any())
        assert not (batch.box.distance[0] < 0)[inside].any()
    hidden = collate([TrainingSamples(items, SampleSpecification(64, 0, obstacle=0.0), seed=0)[0]])
    assert shown and not hidden.obstacle.any()
