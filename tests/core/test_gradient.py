# SPDX-License-Identifier: GPL-3.0-or-later
"""Gradients of scalar fields."""

import numpy as np

from liquid_splash_addon.core.numeric.gradient import unit_gradient


def test_the_gradient_of_a_slanted_field_is_the_same_at_walls_and_inside():
    direction = np.array([3.0, -4.0, 12.0], dtype=np.float32)
    field = np.einsum("a,axyz->xyz", direction, np.indices((5, 6, 7))).astype(np.float32)
    found = unit_gradient(field, np.argwhere(np.ones(field.shape, dtype=bool)))
    np.testing.assert_allclose(found, np.broadcast_to(direction / 13, found.shape), atol=1e-6)


def test_a_flat_field_has_none():
    assert not unit_gradient(np.ones((3, 3, 3), dtype=np.float32), np.array([[1, 1, 1]])).any()
