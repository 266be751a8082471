# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether strokes moved as one is found from the strokes alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from liquid_splash_addon.core.sketch.alignment import similarity_between
from liquid_splash_addon.core.sketch.fit_speed import fitting_gain
from liquid_splash_addon.core.sketch.strokes import Stroke


def strokes(rng: np.random.Generator, count: int = 6, flat: bool = False) -> list[np.ndarray]:
    found = [rng.normal(size=(rng.integers(5, 30), 3)).cumsum(axis=0) for _ in range(count)]
    return [points * (1, 1, 0) for points in found] if flat else found


def similarity(rng: np.random.Generator, mirror: bool = False) -> np.ndarray:
    matrix = np.eye(4)
    turn = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    matrix[:3, :3] = rng.uniform(0.1, 9) * turn @ np.diag([-1.0 if mirror else 1.0, 1, 1])
    matrix[:3, 3] = rng.normal(size=3) * 10
    return matrix


def moved(matrix: np.ndarray, old: list[np.ndarray]) -> list[np.ndarray]:
    return [points @ matrix[:3, :3].T + matrix[:3, 3] for points in old]


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("mirror", [False, True])
def test_a_similarity_is_found_exactly(seed: int, mirror: bool):
    rng = np.random.default_rng(seed)
    old, matrix = strokes(rng), similarity(rng, mirror)
    found = similarity_between(old, moved(matrix, old))
    np.testing.assert_allclose(found, matrix, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("seed", range(10))
def test_it_is_found_among_edited_deleted_and_new_strokes(seed: int):
    rng = np.random.default_rng(seed)
    old, matrix = strokes(rng, 8), similarity(rng)
    new = moved(matrix, old)
    new[2] = new[2] + rng.normal(size=new[2].shape)
    del new[5]
    new.insert(1, rng.normal(size=(17, 3)))
    np.testing.assert_allclose(similarity_between(old, new), matrix, rtol=1e-6, atol=1e-6)


def test_redrawn_strokes_have_not_moved():
    rng = np.random.default_rng(1)
    old = strokes(rng)
    assert similarity_between(old, [rng.normal(size=points.shape) for points in old]) is None
    assert similarity_between(old, []) is None
    assert similarity_between(old, [points * (1, 2, 1) for points in old]) is None


def test_flat_sketches_and_lines_are_not_turned_over():
    rng = np.random.default_rng(2)
    flat, matrix = strokes(rng, flat=True), similarity(rng)
    np.testing.assert_allclose(
        similarity_between(flat, moved(matrix, flat)), matrix, rtol=1e-6, atol=1e-6
    )
    line = [np.linspace(0, 1, 9)[:, None] * (1.0, 2.0, 3.0)]
    shifted = similarity_between(line, [line[0] + (1, 0, 0)])
    np.testing.assert_allclose(shifted[:3, :3], np.eye(3), atol=1e-6)


@pytest.mark.parametrize("speed", [0.01, 0.5, 3.0])
def test_the_fitting_gain(speed: float):
    still = np.zeros((10, 3))
    strokes = [Stroke(still + k, still + (speed * k, 0, 0)) for k in (1.0, 2.0, 3.0)]
    assert fitting_gain(strokes, 5.0) == pytest.approx(0.4 * 5.0 / (2 * speed))
    dash = Stroke(still, still + (100 * speed, 0, 0))
    assert fitting_gain([*strokes, dash], 5.0) == pytest.approx(5.0 / (100 * speed))
    with pytest.raises(ValueError, match="do not move"):
        fitting_gain([Stroke(still, still)], 5.0)
