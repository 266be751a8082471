# SPDX-License-Identifier: GPL-3.0-or-later
"""Roughness and thickness of surfaces, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from liquid_splash_addon.core.grid import Grid
from training.measures.look import averaged, look_beside, look_of

CELLS = 64


def plate(thickness: float, bumps: float = 0.0, wave: float = 6.0) -> np.ndarray:
    """Return the level of a plate across the third axis; bumps : height of waves on both sides."""
    x, _, z = np.indices((CELLS, CELLS, CELLS)).astype(np.float64)
    height = bumps * np.sin(2 * np.pi * x / wave)
    return (np.abs(z - CELLS / 2 - height) - thickness / 2).astype(np.float32)


@pytest.mark.parametrize("thickness", [3.0, 5.0])
def test_a_plate_is_smooth_and_as_thick_as_it_is(thickness):
    found = look_of(plate(thickness), Grid.local(CELLS))
    assert found["thickness_cells"] == pytest.approx(thickness, rel=0.1)
    assert found["roughness_deg"] < 0.1


def test_higher_bumps_are_rougher():
    found = [look_of(plate(5.0, bumps), Grid.local(CELLS)) for bumps in (0.1, 0.2, 0.4)]
    rough = [look["roughness_deg"] for look in found]
    assert 1 < rough[0] < rough[1] < rough[2] < np.degrees(np.arctan(2 * np.pi * 0.4 / 6))


def test_means_over_rings_keep_constants_and_spread():
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    np.testing.assert_allclose(averaged(np.ones((4, 2)), faces, 3), 1)
    np.testing.assert_allclose(averaged(np.eye(4), faces, 1), 0.25)


def test_ratios_are_of_what_both_have():
    found = look_beside({"roughness_deg": 3.0, "thickness_cells": 2.0}, {"roughness_deg": 1.5})
    assert found["roughness_over_truth"] == 2.0 and "thickness_over_truth" not in found
    assert look_of(np.ones((8, 8, 8), np.float32), Grid.local(32)) == {}
