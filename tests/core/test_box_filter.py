# SPDX-License-Identifier: GPL-3.0-or-later
"""Means over cubes of cells."""

import numpy as np

from liquid_splash_addon.core.numeric.box_filter import mean_around


def test_means_leave_out_what_is_negative_and_what_is_no_cell():
    values = np.random.default_rng(0).uniform(-1, 1, (7, 6, 5)).astype(np.float32)
    cells = np.argwhere(values < 2)
    expected = []
    for i, j, k in cells:
        cube = values[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2, max(k - 1, 0) : k + 2]
        expected.append(cube[cube >= 0].mean())
    np.testing.assert_allclose(mean_around(values, cells, 1), expected, rtol=1e-5)
    assert np.isnan(mean_around(-np.ones((3, 3, 3), np.float32), cells[:1], 1)).all()
    assert mean_around(values, cells[:0], 1).shape == (0,)
