# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of models on unseen frames: arithmetic, groups, twins, seeds, pictures, the command."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

torch = pytest.importorskip("torch")

from liquid_splash_addon.core.grid import LOCAL_SPACING, Grid  # noqa: E402
from liquid_splash_addon.core.liquid.fields import AIR, Fields  # noqa: E402
from tests.training.answering import Slabs  # noqa: E402
from training.data.items import load_items  # noqa: E402
from training.evaluation import ceiling, evaluate  # noqa: E402
from training.evaluation.answers import BASELINES, latents_for  # noqa: E402
from training.evaluation.baselines import NearestExample, trace_sketches  # noqa: E402
from training.evaluation.comparison import DRAWN_CELLS, safe_distance, upright, view_of  # noqa: E402
from training.evaluation.diversity import diversity, seeds_row  # noqa: E402
from training.evaluation.diversity import summary as diversity_summary  # noqa: E402
from training.evaluation.report import (  # noqa: E402
    STROKE_GROUPS,
    TIME_GROUPS,
    frames_hash,
    grouped,
    load_kept,
    load_twins,
    merged,
    standard_error,
    summary,
)
from training.measures.metrics import average, relative_divergence  # noqa: E402
from training.measures.shapes import halved  # noqa: E402


def flow(a: float, b: float, c: float) -> np.ndarray:
    """Return a flow that grows by a, b and c a cell along x, y and z, plus 3 along x."""
    x, y, z = np.meshgrid(*[np.arange(10.0)] * 3, indexing="ij")
    return np.stack([a * x + 3, b * y, c * z])


def test_divergence_of_known_flows():
    occupied = np.zeros((10, 10, 10), bool)
    occupied[2:8, 2:8, 2:8] = True
    spreading = flow(0.2, 0.1, 0.0)
    inside = np.s_[:, 3:7, 3:7, 3:7]
    speed = np.linalg.norm(spreading[inside], axis=0).mean()
    assert relative_divergence(spreading, occupied) == pytest.approx(0.3 / speed)
    assert relative_divergence(flow(0.2, -0.3, 0.1), occupied) == pytest.approx(0, abs=1e-12)
    wild_outside = flow(0.2, -0.3, 0.1)
    wild_outside[:, ~occupied] = 1e3
    assert relative_divergence(wild_outside, occupied) == pytest.approx(0, abs=1e-12)
    sheet = np.zeros_like(occupied)
    sheet[:, :, 4:6] = True
    assert np.isnan(relative_divergence(spreading, sheet))


def test_a_mean_leaves_out_what_is_not_there():
    rows = [{"a": 1.0, "b": np.nan, "c": np.nan}, {"a": 3.0, "b": 5.0, "c": np.nan}, {"a": 2.0}]
    assert average(rows) == {"a": 2.0, "b": 5.0}


def test_groups_hold_every_frame_once():
    counts = list(range(5, 21))
    found = grouped([float(n) for n in counts], counts, STROKE_GROUPS)
    assert {name: row["frames"] for name, row in found.items()} == dict.fromkeys(STROKE_GROUPS, 4)
    assert found["5-8"]["iou"] == 6.5 and found["17-20"]["iou"] == 18.5
    times = [0.05, 0.0749, 0.075, 0.2, 0.5]
    found = grouped([1, 0, 1, 0.5, 1], times, TIME_GROUPS)
    assert found == {
        "50-75 ms": {"iou": 0.5, "frames": 2},
        "75-100 ms": {"iou": 1.0, "frames": 1},
        "200-500 ms": {"iou": 0.75, "frames": 2},
    }


def test_the_error_is_that_of_the_scenes():
    rng = np.random.default_rng(0)
    scenes = rng.normal(0.5, 0.1, 12)
    values, numbers = np.repeat(scenes, 5), np.repeat(np.arange(12), 5)
    expected = scenes.std(ddof=1) / np.sqrt(12)
    assert standard_error(values, numbers) == pytest.approx(expected)
    assert standard_error(values, np.arange(60)) < 0.6 * expected
    assert np.isnan(standard_error([0.1, 0.2], [7, 7]))


def test_a_summary_compares_with_the_twins_on_the_same_frames():
    items = [SimpleNamespace(seed=n, time=t) for n, t in ((1, 0.06), (2, 0.08), (3, 0.3))]
    items = [SimpleHashed(**item.__dict__) for item in items]
    rows = [{"iou": 0.4, "tpr": 0.1}, {"iou": 0.2, "tpr": 0.3}, {"iou": 0.9, "tpr": 0.5}]
    found = summary(rows, items, [5, 6, 20], {items[0]: 0.8, items[1]: 0.4})
    assert found["iou"] == pytest.approx(0.5) and found["tpr"] == pytest.approx(0.3)
    assert found["twin_frames"] == 2
    assert found["twin_iou"] == pytest.approx(0.6)
    assert found["iou_over_twin"] == pytest.approx(0.3 / 0.6)
    assert found["by_strokes"]["5-8"] == {"iou": pytest.approx(0.3), "frames": 2}
    assert list(found["by_time"]) == ["50-75 ms", "75-100 ms", "200-500 ms"]
    assert "iou_over_twin" not in summary(rows, items, [5, 6, 20], {})


class SimpleHashed(SimpleNamespace):
    """Stands for an Item."""

    __hash__ = object.__hash__


def test_rows_of_other_models_are_kept():
    old = {
        "about": {"test_hash": "t", "models": {"paper": "p", "ours": "old"}},
        "128": {"paper": {"iou": 1}, "ours": {"iou": 2}, "unet": {"iou": 3}},
        "64": {"paper": {"iou": 4}},
    }
    new = {
        "about": {"test_hash": "t", "models": {"ours": "new"}},
        "128": {"ours": {"iou": 5}},
    }
    assert merged(old, new, ["ours", "unet"]) == {
        "about": {"test_hash": "t", "models": {"paper": "p", "ours": "new"}},
        "128": {"paper": {"iou": 1}, "ours": {"iou": 5}},
        "64": {"paper": {"iou": 4}},
    }
    assert merged({}, new, ["ours"]) == new


def test_rows_of_other_frames_are_not_kept(toy_data: Path, tmp_path: Path):
    items = load_items(toy_data, "test")
    path = tmp_path / "figures.json"
    assert load_kept(path, frames_hash(items)) == {}
    path.write_text(json.dumps({"about": {"test_hash": frames_hash(items)}}))
    assert load_kept(path, frames_hash(items))["about"]
    others = load_items(toy_data, "train")
    for other in (frames_hash(others), frames_hash([*items, *others])):
        with pytest.raises(ValueError, match="leave out --keep"):
            load_kept(path, other)


def test_twins_of_a_data_set_are_measured_once_and_read(toy_data, tmp_path, run_command, capsys):
    out = tmp_path / "twins.json"
    options = ("--data", toy_data, "--split", "test", "--workers", 1, "--out", out)
    assert run_command(ceiling.main, *options) == 0
    items = load_items(toy_data, "test")
    rows = json.loads(out.read_text())
    assert load_twins(out, items) == {items[row["number"]]: row["iou"] for row in rows}
    rows[0]["iou"] = 0.123
    out.write_text(json.dumps(rows))
    assert run_command(ceiling.main, *options) == 0  # nothing left to do
    assert json.loads(out.read_text()) == rows
    rows[0]["time"] += 0.01
    out.write_text(json.dumps(rows))
    with pytest.raises(ValueError, match="other data"):
        load_twins(out, items)
    out.write_text("[{}]")
    with pytest.raises(ValueError, match="no file of `python -m training ceiling"):
        load_twins(out, items)


def test_figures_of_seeds_are_what_they_say():
    def slab(first: int) -> np.ndarray:
        mask = np.zeros((12, 4, 4), bool)
        mask[first : first + 4] = True
        return mask

    strokes = np.zeros((12, 4, 4), bool)
    strokes[3:7, 1, 1] = True
    found = seeds_row([slab(0), slab(2), slab(4)], slab(6), slab(3), strokes)
    # Neighbours share two layers of six; the first and the last none.
    assert found["spread"] == pytest.approx((2 / 3 + 2 / 3 + 1) / 3)
    assert found["iou_zero"] == pytest.approx(1 / 7)
    assert found["iou_best"] == pytest.approx(3 / 5)
    assert found["iou_mean"] == pytest.approx((1 / 7 + 3 / 5 + 3 / 5) / 3)
    assert found["best_gain"] == pytest.approx(3 / 5 - 1 / 7)
    assert found["covered"] == pytest.approx((1 / 4 + 3 / 4 + 3 / 4) / 3)
    assert found["covered_least"] == pytest.approx(1 / 4)
    assert found["covered_near"] == pytest.approx((2 / 4 + 1 + 1) / 3)
    assert found["covered_near_least"] == pytest.approx(2 / 4)
    assert found["covered_by_truth"] == 1
    both = diversity_summary([found, {**found, "covered_least": 0.75, "spread": 0.0}], [0.5, 0.9])
    assert both["covered_least"] == pytest.approx(1 / 4)
    assert both["twin_spread"] == pytest.approx(0.3)
    assert both["spread_over_twin"] == pytest.approx(found["spread"] / 2 / 0.3)


def test_a_coarse_cell_is_liquid_where_its_mean_distance_is():
    x = np.arange(16) + 0.5
    plane = np.broadcast_to((x - 7.1)[:, None, None], (16, 16, 16))
    assert halved(plane)[:, 0, 0].tolist() == [True] * 4 + [False] * 4
    plane = np.broadcast_to((x - 6.9)[:, None, None], (16, 16, 16))
    assert halved(plane)[:, 0, 0].tolist() == [True] * 3 + [False] * 5


def test_diversity_is_measured_against_twins(toy_data: Path):
    items = load_items(toy_data, "test")[:2]
    latents = [np.array([0.0]), np.array([0.5]), np.array([1.0])]
    found = diversity(Slabs(), latents, items, [64, 32], {items[0]: 0.75})
    for row in found.values():
        assert row["spread"] == pytest.approx((2 / 3 + 2 / 3 + 1) / 3)
        assert row["twin_spread"] == pytest.approx(0.25)
        assert row["spread_over_twin"] == pytest.approx(row["spread"] / 0.25)
        assert row["best_gain"] >= 0 and row["frames"] == len(items)
    assert found[64]["draft_iou"] == 1.0 and "draft_iou" not in found[32]
    assert found[64]["draft_iou_truth"] > 0.8
    still = diversity(Slabs(), [np.zeros(1)] * 3, items, [32], {})[32]
    assert still["spread"] == still["best_gain"] == 0 and "spread_over_twin" not in still


def test_latents_of_other_models_differ_by_seed():
    first, second = latents_for(Slabs(), 2), latents_for(Slabs(), 2)
    assert not np.array_equal(*first)
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))


def test_sketches_are_the_same_traced_in_processes(toy_data: Path):
    items = load_items(toy_data, "train")[:3]
    here, there = trace_sketches(items, 1), trace_sketches(items, 2)
    for one, other in zip(here, there, strict=True):
        assert all(np.array_equal(a.points, b.points) for a, b in zip(one, other, strict=True))
    nearest = NearestExample(items)
    grid = Grid.local(32)
    for item, strokes in zip(items, here, strict=True):
        distance, _ = nearest.answer(strokes, grid)
        truth = evaluate.held_out_sample(item, 32)[0].distance
        assert np.array_equal(distance, truth)


@pytest.mark.parametrize("cells", [64, 128])
def test_pictures_stand_upright(cells: int):
    grid = Grid.local(cells)
    axes = Rotation.from_euler("xyz", [40, 20, 70], degrees=True).as_matrix()
    place = np.array([0.05, -0.03, 0.02])  # local metres
    away = np.linalg.norm(grid.centres() - place, axis=-1) - 0.04
    ball = np.clip(away / grid.spacing, -AIR, AIR).astype(np.float32)
    drawn = upright(ball, grid, axes)
    cells_wet = np.argwhere(drawn < 0) + 0.5
    expected = axes.T @ place / LOCAL_SPACING + DRAWN_CELLS / 2
    assert cells_wet.mean(axis=0) == pytest.approx(expected, abs=0.1)
    radius = 0.04 / LOCAL_SPACING
    middles = np.stack(np.indices(drawn.shape), axis=-1) + 0.5
    exact = np.linalg.norm(middles - expected, axis=-1) - radius
    near = np.abs(exact) < 1.5
    assert np.abs(drawn - exact)[near].max() < 0.2
    assert len(cells_wet) == pytest.approx(4 / 3 * np.pi * radius**3, rel=0.03)
    assert view_of(drawn).centre == pytest.approx(expected, abs=0.5)
    assert view_of(drawn).width == pytest.approx(1.25 * 2 * radius, rel=0.06)


def test_no_ray_steps_over_thin_liquid():
    """Whatever a model says of the distance in the air."""
    occupancy = np.zeros((32, 32, 32), np.float32)
    occupancy[16] = 1
    fields = Fields(occupancy, np.where(occupancy > 0, -0.1, AIR), np.zeros(3), Grid.local(32))
    distance = safe_distance(fields)
    assert (distance[16] < 0).all() and (np.delete(distance, 16, axis=0) > 0).all()
    true = np.abs(np.arange(32) - 16.0)[:, None, None]
    assert (distance <= np.where(true > 2, true, AIR)).all()
    assert distance[20].min() == AIR
    empty = Fields(occupancy * 0, np.full_like(occupancy, AIR), np.zeros(3), Grid.local(32))
    assert (safe_distance(empty) == AIR).all()


def test_the_command_measures_models_side_by_side(
    toy_data: Path, tmp_path: Path, run_command, monkeypatch, capsys
):
    known = {"ours": Slabs(), "coarse": Slabs(finest=1 / 40)}

    def load(requests, precision):
        assert precision == "float32"
        names = [request.partition("=")[0] for request in requests]
        return {name: known[name] for name in names}, {name: f"hash of {name}" for name in names}

    monkeypatch.setattr(evaluate, "load_answers", load)
    out, sheet, twins = (tmp_path / name for name in ("a.json", "a.png", "twins.json"))
    items = evaluate.choose(load_items(toy_data, "test"), 2)
    twins.write_text(
        json.dumps(
            [{"seed": i.seed, "number": i.number, "time": i.time, "iou": 0.5} for i in items]
        )
    )
    options = (toy_data, "--most", 2, "--grids", 64, 32, "--seeds", 3, "--diverse", 1, "--out", out)
    shown = ("--twins", twins, "--pictures", sheet, "--shown", 1, "--pixels", 48)
    assert run_command(evaluate.main, *options, *shown, "--models", "ours=x", "coarse=y") == 0
    said = capsys.readouterr()
    assert "coarse is left out at 64^3: the grid is too fine" in said.out + said.err
    with Image.open(sheet) as picture:
        assert picture.size == (4 * 52 - 4, 48 + 12)
    written = json.loads(out.read_text(), parse_constant=pytest.fail)
    assert set(written) == {"about", "64", "32"}
    assert set(written["64"]) == {"ours", *BASELINES}
    assert set(written["32"]) == {"ours", "coarse", *BASELINES}
    row = written["32"]["ours"]
    assert row["iou"] == written["32"]["coarse"]["iou"]
    assert row["iou_over_twin"] == pytest.approx(row["iou"] / 0.5)
    assert row["divergence"] == 0 and row["velocity_error"] > 0
    assert sum(group["frames"] for group in row["by_time"].values()) == len(items)
    assert row["diversity"]["spread_over_twin"] == pytest.approx(row["diversity"]["spread"] / 0.5)
    assert written["64"]["ours"]["diversity"]["draft_iou"] > 0.3
    for table in ("| 64^3 | ours |", "IoU by strokes", "IoU by time", "Several seeds"):
        assert table in said.out

    options = (*options[:-1], out, "--keep")
    assert run_command(evaluate.main, *options, "--models", "coarse=z") == 0
    again = json.loads(out.read_text())
    assert again["32"]["ours"] == row and again["64"]["ours"] == written["64"]["ours"]
    assert "twin_iou" not in again["32"]["coarse"]  # measured anew, without twins
    assert again["about"]["models"] == {"ours": "hash of ours", "coarse": "hash of coarse"}
    assert run_command(evaluate.main, *options, "--most", 1, "--models", "coarse=z") == 1
    assert "leave out --keep" in capsys.readouterr().err
