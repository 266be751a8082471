# SPDX-License-Identifier: GPL-3.0-or-later
"""The critic that tells simulated surfaces from generated ones."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from training.evaluation import critic

STEPS = 40


def ball(radius: float, bumps: float = 0.0, cells: int = 48) -> np.ndarray:
    """Return the level of a ball, or of one with bumps of so many cells."""
    x, y, z = np.indices((cells,) * 3) - (cells - 1) / 2
    waves = bumps * np.sin(1.3 * x) * np.sin(1.3 * y) * np.sin(1.3 * z)
    return (np.sqrt(x**2 + y**2 + z**2) - radius + waves).astype(np.float32)


def test_only_the_surface_is_seen_not_how_its_level_is_written():
    level = ball(12.0)
    near = np.abs(critic.seen(level)) < 1
    np.testing.assert_allclose(critic.seen(level)[near], level[near], atol=0.2)
    np.testing.assert_allclose(critic.seen(3 * level)[near], critic.seen(level)[near], atol=0.15)


def test_crops_hold_the_surface_in_their_middle():
    crops = critic.crops_of(ball(12.0), np.random.default_rng(0), 6)
    assert crops.shape == (6, 32, 32, 32) and crops.dtype == np.int8
    assert (np.abs(crops[:, 16, 16, 16]) < critic.CODES).all()
    assert len(critic.crops_of(np.ones((40,) * 3, np.float32), np.random.default_rng(0))) == 0


def test_auc_is_the_share_of_pairs_in_order():
    labels = np.array([True, True, False, False])
    assert critic.auc(np.array([3.0, 1.0, 2.0, 0.0]), labels) == 0.75
    assert critic.auc(np.zeros(4), labels) == 0.5
    assert np.isnan(critic.auc(np.zeros(2), labels[:2]))


def test_it_learns_to_tell_bumps_and_goes_on_where_it_was(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(critic, "BATCH", 12)
    rng = np.random.default_rng(0)
    smooth = np.concatenate([critic.crops_of(ball(r), rng, 16) for r in (11, 13, 15)])
    bumpy = np.concatenate([critic.crops_of(ball(r, 1.5), rng, 16) for r in (11, 13, 15)])
    crops = np.concatenate([smooth, bumpy])
    labels = np.arange(len(crops)) < len(smooth)
    path = tmp_path / "critic.pt"
    network = critic.train(crops, labels, path, 0, STEPS)
    fresh = [critic.crops_of(ball(14, bumps), rng, 16) for bumps in (0.0, 1.5)]
    values = critic.scores(network, np.concatenate(fresh))
    assert critic.auc(values, np.arange(32) < 16) > 0.9
    again = critic.train(crops, labels, path, 0, STEPS)
    np.testing.assert_array_equal(critic.scores(again, crops), critic.scores(network, crops))


@pytest.mark.slow
def test_the_command_keeps_its_crops(toy_data: Path, tmp_path: Path, run_command, capsys):
    options = ("--out", tmp_path / "run", "--frames", 2, "--tests", 2, "--twins", 1)
    assert run_command(critic.main, toy_data, *options, "--minutes", 0.02) == 0
    figures = json.loads((tmp_path / "run" / "critic.json").read_text())
    assert {"auc_train", "auc_test", "auc_twins"} <= figures.keys()
    assert "auc_test" in capsys.readouterr().out
    assert run_command(critic.main, tmp_path, "--out", tmp_path / "none") == 1
