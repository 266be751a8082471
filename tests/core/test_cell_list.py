# SPDX-License-Identifier: GPL-3.0-or-later
"""The counting sort into cells."""

import numpy as np

from liquid_splash_addon.core.numeric.cell_list import cell_list, counting_sort


def test_the_order_is_stable_and_every_key_begins_where_it_should():
    keys = np.random.default_rng(0).integers(0, 7, 50)
    keys[keys == 3] = 2  # a key that nothing has
    order, first = counting_sort(keys, 8)
    np.testing.assert_array_equal(order, np.argsort(keys, kind="stable"))
    np.testing.assert_array_equal(first, np.searchsorted(keys[order], np.arange(9)))


def test_nothing_can_be_sorted():
    order, first = counting_sort(np.zeros(0, dtype=np.int32), 3)
    assert not len(order)
    assert not first.any() and len(first) == 4


def test_points_are_found_in_their_cells():
    rng = np.random.default_rng(1)
    points = rng.uniform((-1, 2, 0), (1, 5, 0.4), (200, 3)).astype(np.float32)
    low, shape = points.min(axis=0), np.array([3, 4, 1])
    order, first = cell_list(points, low, np.float32(0.8), shape)
    for number, cell in enumerate(np.ndindex(*shape)):
        here = points[order[first[number] : first[number + 1]]]
        np.testing.assert_array_equal(
            ((here - low) / 0.8).astype(int), np.tile(cell, (len(here), 1))
        )
    assert sorted(order) == list(range(200))
