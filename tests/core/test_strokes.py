# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes, their resampling and what is wrong with bad ones."""

import numpy as np
import pytest

from liquid_splash_addon.core.sketch.strokes import Stroke, StrokeError, check_strokes, resample

from .sketching import line

NOTHING = np.zeros((0, 3))


def test_resampling_keeps_ends_length_and_linear_velocity():
    path = np.cumsum(np.random.default_rng(1).random((9, 3)), axis=0)
    stroke = Stroke(path, path * 2)
    dense = resample(stroke, 0.05)
    assert np.allclose(dense.points[[0, -1]], stroke.points[[0, -1]])
    steps = np.linalg.norm(np.diff(dense.points, axis=0), axis=1)
    assert steps.max() <= 0.05 + 1e-6
    assert len(dense.points) == np.ceil(stroke.length / 0.05) + 1
    assert np.allclose(dense.velocities, dense.points * 2, atol=1e-5)


@pytest.mark.parametrize(
    ("strokes", "advice"),
    [
        ([], "Draw at least one stroke"),
        ([Stroke([[0, 0, 0]], [[0, 0, 0]])], "at least two"),
        ([Stroke(NOTHING, NOTHING)], "at least two"),
        (
            [line((0, 0, 0), (1, 0, 0)), Stroke([[1, 1, 1]] * 5, [[0, 0, 0]] * 5)],
            "Stroke 2 has no length",
        ),
        ([Stroke([[0, 0, np.nan], [1, 0, 0]], [[0, 0, 0]] * 2)], "not a number"),
        ([Stroke([[0, 0, 0], [1, 0, 0]], [[0, np.inf, 0]] * 2)], "not a number"),
    ],
    ids=["none", "one point", "no points", "all equal", "nan", "infinite velocity"],
)
def test_bad_strokes_say_what_to_do(strokes, advice):
    with pytest.raises(StrokeError, match=advice):
        check_strokes(strokes)


def test_shapes_are_checked():
    with pytest.raises(StrokeError, match="one velocity a point"):
        Stroke([[0, 0, 0], [1, 0, 0]], [[0, 0, 0]])
    with pytest.raises(StrokeError, match=r"\(n, 3\)"):
        Stroke([0, 0, 0], [0, 0, 0])
