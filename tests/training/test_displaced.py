# SPDX-License-Identifier: GPL-3.0-or-later
"""How exactly liquid must be placed."""

from pathlib import Path

import numpy as np
import pytest

from training.research import displaced


def sheet(thick: float, cells: int = 48) -> np.ndarray:
    """Return the distance to a flat sheet across the box."""
    away = np.abs(np.arange(cells) + 0.5 - cells / 2) - thick / 2
    return np.broadcast_to(away[:, None, None], (cells,) * 3).astype(np.float32)


def test_a_sheet_is_as_thick_as_it_is():
    assert displaced.thickness(sheet(4.0)) == pytest.approx(4.0, rel=0.02)


def test_a_sheet_that_is_moved_across_itself_loses_what_geometry_says():
    """By d of its thickness t, (t - d) / (t + d) is left."""
    across, along = np.zeros((3, 48, 48, 48)), np.zeros((3, 48, 48, 48))
    across[0], along[1] = 2.0, 2.0
    assert displaced.moved_iou(sheet(6.0), across) == pytest.approx(4 / 8)
    assert displaced.moved_iou(sheet(6.0), along) == 1.0


def test_moves_have_the_size_that_they_should():
    moves = displaced.random_moves((48,) * 3, np.random.default_rng(0))
    assert np.abs(moves.std((1, 2, 3)) - 1).max() < 0.01
    neighbours = np.corrcoef(moves[0, 1:].ravel(), moves[0, :-1].ravel())[0, 1]
    assert neighbours > 0.98


def test_the_command_tells_of_frames(toy_data: Path, run_command, capsys):
    assert run_command(displaced.main, toy_data, "--most", 1, "--cells", 32) == 0
    said = capsys.readouterr().out
    values = [float(line.split()[-1]) for line in said.splitlines() if "IoU" in line]
    assert len(values) == len(displaced.MOVE_SIZES) and values == sorted(values, reverse=True)
    assert "cells thick" in said
    assert run_command(displaced.main, toy_data / "none") == 1
