# SPDX-License-Identifier: GPL-3.0-or-later
"""Balls have the volume that their radii say, and their faces look outward."""

import numpy as np
import pytest

from liquid_splash_addon.core.mesh.spheres import spheres
from tests.core.solids import is_closed, volume


def test_balls_are_closed_and_as_large_as_they_should_be():
    centres = np.float32([[1, 2, 3], [-4, 0, 0]])
    radii = np.float32([0.5, 2.0])
    mesh = spheres(centres, 3 * centres, radii)
    assert is_closed(mesh.faces)
    expected = 4 / 3 * np.pi * (radii.astype(float) ** 3).sum()
    assert volume(mesh.vertices.astype(float), mesh.faces) == pytest.approx(expected, rel=1e-4)
    half = len(mesh.vertices) // 2
    for part, centre, radius in zip(np.split(mesh.vertices, [half]), centres, radii, strict=True):
        away = np.linalg.norm(part - centre, axis=1)
        assert np.abs(away / radius - 1).max() < 0.02
    assert (mesh.velocities[:half] == 3 * centres[0]).all()


def test_no_balls_are_no_mesh():
    none = np.zeros((0, 3), np.float32)
    assert not len(spheres(none, none, none[:, 0]).faces)
