# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquid kept near its strokes."""

import numpy as np
import pytest

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import AIR, Fields
from liquid_splash_addon.core.liquid.shaping import reshaped
from liquid_splash_addon.core.liquid.stroke_reach import CUT_WIDTH, within_reach
from liquid_splash_addon.core.mesh.marching_cubes import surface
from tests.core.sketching import line

CELLS = 48
REACH = 5.0
"""Cells."""


@pytest.fixture(scope="module")
def grid():
    """Return a grid about the origin."""
    return Grid.local(128).crop((40, 40, 40), (CELLS,) * 3)


def lines(grid):
    """Return two parallel strokes along x in the middle of the grid, 20 cells apart."""
    middle = np.asarray(grid.to_metres(np.full(3, CELLS / 2)))
    half = grid.spacing * np.array([16.0, 10.0, 0.0])
    return [
        line(middle + half * [-1, side, 0], middle + half * [1, side, 0], speed=2.0)
        for side in (-1, 1)
    ]


def sheet(grid):
    """Return a sheet 4 cells thick and 40 wide that holds both strokes, flowing along x."""
    cells = np.stack(np.meshgrid(*(np.arange(CELLS) + 0.5,) * 3, indexing="ij"))
    out = np.abs(cells - CELLS / 2) - np.array([20.0, 20.0, 2.0])[:, None, None, None]
    distance = np.clip(out.max(axis=0), -AIR, AIR).astype(np.float32)
    occupancy = (1 / (1 + np.exp(2 * distance))).astype(np.float32)
    velocity = np.zeros((3, *distance.shape), dtype=np.float32)
    velocity[0] = 2.0 * (distance < AIR)
    return Fields(occupancy, distance, velocity, grid)


def away_from(strokes, grid):
    """Return the distance of each cell to the straight strokes, in cells."""
    centres = grid.centres()
    away = []
    for stroke in strokes:
        start, stop = stroke.points[0], stroke.points[-1]
        along = stop - start
        share = np.clip((centres - start) @ along / (along @ along), 0, 1)
        away.append(np.linalg.norm(centres - start - share[..., None] * along, axis=-1))
    return np.minimum.reduce(away) / grid.spacing


def kept_to(fields, strokes, reach):
    """Return the liquid no farther than ``reach`` metres from the strokes."""
    return reshaped(fields, lambda liquid: within_reach(liquid, strokes, reach))


def test_no_reach_is_no_bound(grid):
    fields = sheet(grid)
    assert kept_to(fields, lines(grid), 0.0) is fields


def test_only_what_is_near_a_stroke_stays(grid):
    fields, strokes = sheet(grid), lines(grid)
    kept = kept_to(fields, strokes, REACH * grid.spacing)
    away = away_from(strokes, grid)
    wet, before = kept.occupancy > 0.5, fields.occupancy > 0.5
    assert wet.any() and not wet[away > REACH].any()
    inner = away < REACH - CUT_WIDTH
    assert (wet[inner] == before[inner]).all(), "what is well inside stays as it was"
    assert not wet[:, CELLS // 2].any(), "the sheet between the strokes is gone"
    assert ((kept.distance < 0) == wet).all()
    assert not kept.velocity[:, kept.distance >= AIR].any()


def test_the_cut_is_closed_and_round(grid):
    mesh = surface(kept_to(sheet(grid), lines(grid), REACH * grid.spacing))
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 2).all()
    # A sharp cut of a flat sheet has normals along y and z only; a rim has all between.
    a, b, c = (mesh.vertices[mesh.faces[:, n]] for n in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
    slanted = (np.abs(normal[:, 1]) > 0.3) & (np.abs(normal[:, 2]) > 0.3)
    assert slanted.mean() > 0.1


def test_a_reach_beyond_all_liquid_leaves_its_cells(grid):
    fields = sheet(grid)
    kept = kept_to(fields, lines(grid), 0.2)
    assert ((kept.occupancy > 0.5) == (fields.occupancy > 0.5)).all()


def test_a_reach_finer_than_a_cell_may_leave_nothing_and_does_not_fail(grid):
    kept = kept_to(sheet(grid), lines(grid), 1e-4)
    assert (kept.occupancy <= 0.5).all()
