# SPDX-License-Identifier: GPL-3.0-or-later
"""Marching cubes in slabs."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from liquid_splash_addon.core.mesh import isosurface as module
from liquid_splash_addon.core.mesh.isosurface import isosurface
from liquid_splash_addon.core.mesh.mesh import edge_counts


def noise(shape, seed=0):
    """Return a smooth random level, positive at the sides."""
    level = gaussian_filter(np.random.default_rng(seed).normal(size=shape), 1.5)
    level = (level / level.std()).astype(np.float32)
    level[[0, -1]] = level[:, [0, -1]] = level[:, :, [0, -1]] = 3
    return level


def triangles(points, faces):
    """Return the corners of all triangles, sorted, each beginning at its least corner."""
    corners = points[faces].round(4)
    first = [min(range(3), key=lambda n: tuple(three[n])) for three in corners]
    turned = [np.roll(three, -n, axis=0).ravel() for three, n in zip(corners, first, strict=True)]
    return np.array(sorted(map(tuple, turned)))


@pytest.mark.parametrize("layers", [1, 5, 24])
def test_slabs_give_the_same_surface(layers, monkeypatch):
    level = noise((40, 30, 20))
    monkeypatch.setattr(module, "LAYERS", layers)
    points, faces = isosurface(level, 0.2)
    expected = module.whole(level, 0.2)
    assert len(points) == len(expected[0])
    assert np.allclose(triangles(points, faces), triangles(*expected), atol=2e-4)
    assert edge_counts(faces, len(points)).data.max() == 1
    assert (edge_counts(faces, len(points)) != edge_counts(faces, len(points)).T).nnz == 0


def test_a_value_equal_to_the_isovalue_is_no_trouble(monkeypatch):
    monkeypatch.setattr(module, "LAYERS", 5)
    level = np.round(noise((31, 20, 20)))  # most values are whole
    points, faces = isosurface(level, 0.0)
    expected = module.whole(level, 0.0)
    assert np.array_equal(points, expected[0]) and np.array_equal(faces, expected[1])


def test_slabs_without_a_surface_are_left_out(monkeypatch):
    monkeypatch.setattr(module, "LAYERS", 4)
    level = np.ones((40, 8, 8), dtype=np.float32)
    level[30:33, 3:5, 3:5] = -1
    points, faces = isosurface(level, 0.0)
    assert len(points) == len(module.whole(level, 0.0)[0])
    assert len(faces) == len(module.whole(level, 0.0)[1])


def test_a_level_without_the_isovalue_is_refused():
    with pytest.raises(ValueError, match="no such value"):
        isosurface(np.ones((4, 4, 4), dtype=np.float32), 0.0)
