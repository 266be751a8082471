# SPDX-License-Identifier: GPL-3.0-or-later
"""Where answers miss the truth."""

from pathlib import Path

import numpy as np
import pytest

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.sketch.strokes import Stroke
from training.research import error_analysis


def plate(middle: float, thickness: float, cells: int = 32) -> np.ndarray:
    """Return the signed distance, cells, to a plate across the third axis."""
    away = np.abs(np.arange(cells) + 0.5 - middle) - thickness / 2
    return np.broadcast_to(away, (cells,) * 3).astype(np.float32)


def test_what_is_missed_and_added_is_told_by_how_far_off_it_is():
    truth = plate(10, 4) < 0
    shares = error_analysis.missed_and_added(plate(11, 4) < 0, truth)
    assert shares["found"] == pytest.approx(3 / 4) and shares["iou"] == pytest.approx(3 / 5)
    assert shares["missed_1"] == shares["added_1"] == pytest.approx(1 / 4)
    far = error_analysis.missed_and_added(plate(24, 4) < 0, truth)
    assert far["found"] == 0 and far["missed_far"] == far["added_far"] == pytest.approx(1)
    nothing = error_analysis.missed_and_added(np.zeros_like(truth), truth)
    assert nothing["missed_far"] == 1 and nothing["added_far"] == 0


def test_answers_are_told_apart_by_how_far_it_is_to_a_stroke():
    drawn = np.zeros((32,) * 3, dtype=bool)
    drawn[:, :, 10] = True
    truth, guess = plate(10.5, 7) < 0, plate(10.5, 3) < 0
    found = error_analysis.by_distance(guess, truth, drawn)
    assert found["iou_to_0.5"] == found["iou_to_1.5"] == 1 and found["iou_to_3"] == 0
    assert found["truth_to_0.5"] == pytest.approx(1 / 7)
    assert found["truth_to_3"] == pytest.approx(2 / 7 + 2 / 7) and np.isnan(found["iou_beyond"])


def test_the_middle_of_a_plate_is_found_from_either_side_and_none_too_far():
    along = np.array([[0.0, 0.0, 1.0]])
    for height, normal, expected in ((9.0, 1, 3.0), (15.0, 1, -3.0), (15.0, -1, 3.0)):
        where = np.array([[16.0, 16.0, height]])
        found = error_analysis.to_the_middle(plate(12, 4), where, normal * along)
        assert found == pytest.approx(expected, abs=error_analysis.SEARCH_STEP)
    assert np.isnan(
        error_analysis.to_the_middle(plate(12, 4), np.array([[16.0, 16.0, 25.0]]), along)
    )


def test_patches_off_a_plate_are_best_when_moved_into_it():
    """Strokes two cells above a plate have patches like it, in the wrong place."""
    grid = Grid.local(64)
    truth = plate(30.5, 3, 64)
    low = np.asarray(grid.origin)
    strokes = []
    for column in np.linspace(12, 52, 6):
        cells = np.stack([np.linspace(8, 56, 40), np.full(40, column), np.full(40, 34.0)], axis=1)
        strokes.append(Stroke(low + cells * grid.spacing, np.ones((40, 3))))
    found = error_analysis.patches_at_best(strokes, truth, grid)
    assert found["patches"] == found["patches_in_liquid"] == 0
    assert found["patches_moved"] > 0.4  # of the plate, the strokes leave a rim


def test_the_command(toy_data: Path, run_command, capsys):
    assert (
        run_command(error_analysis.main, toy_data, "--most", 1, "--cells", 64, "--split", "train")
        == 0
    )
    values = dict(line.split() for line in capsys.readouterr().out.splitlines())
    assert 0 < float(values["patches_in_liquid"]) <= float(values["patches_moved"]) <= 1
    missed = sum(float(values[f"missed_{n}"]) for n in ("1", "2", "4", "far"))
    assert float(values["found"]) + missed == pytest.approx(1, abs=0.01)
    assert (
        run_command(
            error_analysis.main,
            toy_data,
            "--most",
            1,
            "--cells",
            64,
            "--split",
            "train",
            "--strokes",
            1,
        )
        == 0
    )
    fewer = dict(line.split() for line in capsys.readouterr().out.splitlines())
    assert float(fewer["truth_to_0.5"]) < float(values["truth_to_0.5"])
    assert run_command(error_analysis.main, toy_data / "none") == 1
