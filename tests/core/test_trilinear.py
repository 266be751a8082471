# SPDX-License-Identifier: GPL-3.0-or-later
"""Trilinear sampling of fields."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from liquid_splash_addon.core.numeric.trilinear import sample_field, trilinear, velocity_at

RNG = np.random.default_rng(0)
FIELD = RNG.normal(size=(3, 4, 5, 6)).astype(np.float32)
# Also outside the field, and on its outermost centres.
POINTS = np.concatenate([RNG.uniform(-2, 8, (200, 3)), [[0.5] * 3, [3.5, 4.5, 5.5]]])


def test_samples_are_those_of_scipy_clamped_at_the_ends():
    expected = [
        map_coordinates(part, (POINTS - 0.5).T, np.float64, order=1, mode="nearest")
        for part in FIELD
    ]
    np.testing.assert_allclose(sample_field(FIELD, POINTS), np.stack(expected, 1), atol=1e-6)


def test_a_scalar_is_sampled_as_a_field_is():
    found = [trilinear(FIELD[0], *point) for point in POINTS]
    np.testing.assert_allclose(found, sample_field(FIELD, POINTS)[:, 0], atol=1e-6)


def test_unknown_velocities_are_left_out_of_the_mean():
    velocity = np.zeros((2, 2, 2, 3), dtype=np.float32)
    velocity[0, 0, 0] = (3, 0, 4)
    out = np.empty(3)
    assert velocity_at(velocity, 1.2, 0.9, 1.0, out) == pytest.approx(5)
    np.testing.assert_allclose(out, (3, 0, 4))
    assert velocity_at(np.zeros_like(velocity), 1.0, 1.0, 1.0, out) == 0
    assert not out.any()
