# SPDX-License-Identifier: GPL-3.0-or-later
"""The grid's map between metres and cells."""

import numpy as np

from liquid_splash_addon.core.grid import LOCAL_CELLS, LOCAL_SPACING, Grid


def test_maps_are_inverse():
    grid = Grid((4, 5, 6), 0.25, (-1.0, 2.0, 0.5))
    points = np.random.default_rng(0).normal(size=(50, 3))
    assert np.allclose(grid.to_metres(grid.to_cells(points)), points)


def test_centres_lie_in_their_cells():
    grid = Grid((4, 5, 6), 0.25, (-1.0, 2.0, 0.5))
    expected = np.stack(np.meshgrid(*map(np.arange, grid.shape), indexing="ij"), axis=-1)
    assert (grid.cell_of(grid.centres()) == expected).all()


def test_draft_covers_the_same_box():
    full, draft = Grid.local(), Grid.local(64)
    assert full.size == draft.size == (LOCAL_CELLS * LOCAL_SPACING,) * 3
    assert full.origin == draft.origin


def test_crop_keeps_cells_in_place():
    full = Grid.local()
    part = full.crop((16, 32, 0), (64, 64, 64))
    assert np.allclose(part.centres()[3, 4, 5], full.centres()[19, 36, 5])


def test_walls_belong_to_one_side():
    grid = Grid((2, 2, 2), 1.0, (0.0, 0.0, 0.0))
    assert grid.contains([[0, 0, 0], [2, 1, 1], [-0.01, 1, 1]]).tolist() == [True, False, False]
