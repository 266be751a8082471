# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures, statistics and the ceiling."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from training.data.frames import load_parameters
from training.data.inspect import histogram
from training.data.inspect import main as inspect_main
from training.data.items import SPLITS, list_items, load_items
from training.evaluation.ceiling import frame_iou, stored_twins
from training.evaluation.ceiling import main as ceiling_main
from training.figures.picture import contact_sheet, draw_liquid, titled
from training.research import ruptures
from training.scenes.bodies import NOTHING, Body
from training.scenes.scene import Scene


def ball(radius=12.0, side=40):
    """Return the clipped distance of a ball in the middle of a cube of cells."""
    axis = np.arange(side) + 0.5 - side / 2
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    return np.clip(np.sqrt(x * x + y * y + z * z) - radius, -3, 3).astype(np.float32)


def blueness(picture):
    """Return how much bluer than red each pixel is, 0..255."""
    pixels = np.asarray(picture).astype(int)
    return pixels[..., 2] - pixels[..., 0]


def test_a_ball_is_drawn_as_a_disc_of_its_size():
    picture = draw_liquid(ball(), 120, width=48.0)
    wet = blueness(picture) > 25
    assert wet.sum() == pytest.approx(np.pi * (12 / 48 * 120) ** 2, rel=0.04)
    rows, columns = np.nonzero(wet)
    assert (rows.mean(), columns.mean()) == pytest.approx((59.5, 59.5), abs=1)


def test_a_solid_hides_what_lies_behind_it_and_strokes_lie_on_top():
    towards_camera = np.array([20 + 10 * np.cos(0.6), 20 + 10 * np.sin(0.6), 26.0])
    solid = Body("sphere", 8.0, 8.0, towards_camera, np.eye(3))
    free, hidden = (draw_liquid(ball(), 80, body, width=48.0) for body in (NOTHING, solid))
    assert (blueness(hidden) > 25).sum() < 0.8 * (blueness(free) > 25).sum()
    line = np.array([[20.0, 20, 10], [20, 20, 30]])
    drawn = draw_liquid(ball(), 80, strokes=[line], width=48.0)
    change = np.abs(np.asarray(drawn).astype(int) - np.asarray(free)).max(axis=-1)
    rows, columns = np.nonzero(change > 20)
    assert np.ptp(rows) == pytest.approx(20 / 48 * 80 * np.cos(np.radians(22)), abs=3)
    assert np.abs(columns - 40).max() < 3


def test_a_contact_sheet_holds_all_pictures():
    pictures = [Image.new("RGB", (10, 10), (n, n, n)) for n in range(5)]
    sheet = np.asarray(contact_sheet(pictures, columns=3, gap=2))
    assert sheet.shape == (22, 34, 3)
    assert sheet[15, 15].tolist() == [4, 4, 4]
    assert sheet[15, 30].tolist() == [255, 255, 255]


def test_a_title_stands_above_its_picture():
    picture = Image.new("RGB", (170, 40), (10, 20, 30))
    pixels = np.asarray(titled(picture, "truth"))
    assert pixels.shape == (55, 170, 3)
    assert (pixels[15:] == (10, 20, 30)).all()
    assert pixels[:15].min() < 100 and (pixels[:15, 80:] == 255).all()


def test_a_histogram_shows_shares():
    lines = histogram("things", [0.1, 0.2, 0.7, 5.0], (0, 0.5, 1))
    assert lines[0] == "things"
    assert "66.7%" in lines[1] and "33.3%" in lines[2]
    assert lines[1].count("#") == 2 * lines[2].count("#") > 0


def test_inspect_says_what_there_is_and_draws_it(toy_data: Path, tmp_path, run_command, capsys):
    sheet = tmp_path / "sheet.png"
    options = ("--most", 2, "--sheet", sheet, "--pictures", 2, "--columns", 2, "--pixels", 64)
    assert run_command(inspect_main, toy_data, *options) == 0
    text = capsys.readouterr().out
    for split in SPLITS:
        assert f"{split}: 1 scenes, {len(list_items(toy_data, split))} frames" in text
    assert "kB a frame" in text and "sketches:" in text and "spray:" in text
    picture = Image.open(sheet)
    assert picture.size == (132, 64)
    assert (blueness(picture) > 25).mean() > 0.01


def test_inspect_says_when_there_is_nothing(tmp_path: Path, run_command, capsys):
    assert run_command(inspect_main, tmp_path) == 1
    assert "python -m training simulate" in capsys.readouterr().err


def test_frames_of_twins_are_compared_where_they_lie(toy_data: Path):
    frame = list_items(toy_data, "train")[0].load()
    moved = type(frame)(
        frame.distance, frame.velocity, frame.start + 100, frame.droplets, frame.time
    )
    assert frame_iou(frame, frame) == 1.0
    assert frame_iou(frame, moved) == 0.0


def test_the_ceiling_is_measured(tmp_path: Path, run_command, capsys):
    out = tmp_path / "ceiling.json"
    options = ("--scenes", 2, "--resolution", 32, "--workers", 1, "--out", out)
    assert run_command(ceiling_main, *options) == 0
    rows = json.loads(out.read_text())
    values = [row["iou"] for row in rows]
    assert rows and 0.3 < np.mean(values) < 1
    assert f"mean over {len(rows)} frames: {np.mean(values):.3f}" in capsys.readouterr().out


def test_a_scene_is_made_again_from_its_parameters(toy_data: Path):
    for path in toy_data.glob("scene_*.npz"):
        parameters = load_parameters(path)
        again = Scene.of(parameters).parameters()
        assert again == {name: parameters[name] for name in again}


def test_a_scene_without_other_seeding_is_its_own_twin(toy_data: Path):
    items = load_items(toy_data, "test")
    same, other = stored_twins(items, jitter_seed=0), stored_twins(items)
    assert [(row["number"], row["time"]) for row in same] == [(i.number, i.time) for i in items]
    assert [row["iou"] for row in same] == [1.0] * len(items)
    assert other and all(0.2 < row["iou"] < 1.0 for row in other)


def test_ruptures_are_counted_by_speed(toy_data: Path, run_command, capsys):
    rows = [{"speed": s, "pieces": p} for s, p in ((3.0, 1.0), (1.0, 5.0), (2.0, 2.0), (4.0, 3.0))]
    slow, fast = ruptures.by_speed(rows, 2)
    assert slow == {"speed": 1.5, "pieces": 3.5, "frames": 2}
    assert fast == {"speed": 3.5, "pieces": 2.0, "frames": 2}
    assert run_command(ruptures.main, toy_data, "--most", 3) == 0
    found = json.loads(capsys.readouterr().out)
    groups = found["by speed"]
    assert set(found["slopes"]) == {"pieces", "holes", "surface"}
    assert [group["frames"] for group in groups] == [1, 1, 1]
    assert [g["speed"] for g in groups] == sorted(g["speed"] for g in groups)
    assert all(0 < g["surface"] <= 1 and g["pieces"] >= 0 for g in groups)
    assert run_command(ruptures.main, toy_data / "none") == 1


def test_what_speed_does_is_told_from_what_size_does():
    """Large splashes are fast ones here: over all sketches it looks as if speed ruptured."""
    rng = np.random.default_rng(0)
    size = np.exp(rng.normal(size=120))
    speed = size**0.8 * np.exp(0.3 * rng.normal(size=120))
    surface = 0.5 - 0.1 * np.log(speed) + 0.3 * np.log(size)
    pieces = np.expm1(2.0 - 0.1 * np.log(speed) + 0.3 * np.log(size))
    rows = [
        {"speed": v, "size": s, "surface": a, "pieces": p, "holes": p, "seed": n // 4}
        for n, (v, s, a, p) in enumerate(zip(speed, size, surface, pieces, strict=True))
    ]
    found = ruptures.slopes(rows)
    for name in ("pieces", "surface"):
        assert found[name]["of one size"][0] == pytest.approx(-0.1, abs=1e-6)
        assert found[name]["of one size"][1] < 1e-6
        assert found[name]["all"][0] > 0.1
    noisy = [{**row, "surface": row["surface"] + rng.normal()} for row in rows]
    value, error = ruptures.slope_and_error(noisy, "surface", ("size",))
    # As ordinary least squares would have it: 1 / (0.3 sqrt 120).
    assert abs(value + 0.1) < 3 * error and error == pytest.approx(0.3, rel=0.4)
