# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes on a grid."""

import numpy as np
import pytest

from liquid_splash_addon.core.condition.channels import STROKE_OFFSET, STROKE_VELOCITY
from liquid_splash_addon.core.condition.voxelize import outside_share
from liquid_splash_addon.core.grid import Grid

from .sketching import condition_of, line

GRID = Grid((16, 16, 16), 0.1, (0.0, 0.0, 0.0))


def test_an_axis_line_crosses_a_row_of_cells():
    condition = condition_of(
        [line((0.25, 0.55, 0.85), (1.25, 0.55, 0.85), speed=3.0)], GRID
    ).dense()
    expected = np.zeros(GRID.shape, bool)
    expected[2:13, 5, 8] = True
    assert ((condition[0] > 0) == expected).all()
    assert np.allclose(condition[1][expected], 3.0)
    assert not condition[:, ~expected].any()


def test_the_place_of_a_stroke_in_its_cells_is_known():
    condition = condition_of([line((0.25, 0.57, 0.81), (1.25, 0.57, 0.81))], GRID).dense()
    place = condition[STROKE_OFFSET][:, condition[0] > 0]
    assert np.abs(place[0]).max() <= 0.5
    assert np.allclose(place[1], 0.2, atol=1e-4) and np.allclose(place[2], -0.4, atol=1e-4)


def test_crossing_strokes_are_averaged():
    strokes = [
        line((0.05, 0.55, 0.55), (1.05, 0.55, 0.55), 2.0, points=41),
        line((0.55, 0.05, 0.55), (0.55, 1.05, 0.55), 2.0, points=41),
    ]
    assert condition_of(strokes, GRID).dense()[STROKE_VELOCITY, 5, 5, 5] == pytest.approx(
        [1.0, 1.0, 0.0], abs=1e-5
    )


def test_direction_of_sampling_does_not_matter():
    forward = line((0.11, 0.22, 0.33), (1.37, 1.22, 0.91), 1.0)
    few = line((0.11, 0.22, 0.33), (1.37, 1.22, 0.91), 1.0, points=2)
    assert (condition_of([forward], GRID).drawn == condition_of([few], GRID).drawn).mean() > 0.999


def test_outside_is_left_out_and_measured():
    stroke = line((0.85, 0.5, 0.5), (2.45, 0.5, 0.5))
    assert outside_share([stroke], GRID) == pytest.approx(0.5, abs=0.05)
    assert condition_of([stroke], GRID).drawn.sum() == 8
