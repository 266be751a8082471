# SPDX-License-Identifier: GPL-3.0-or-later
"""Edges of which the generator is not sure."""

import numpy as np
import pytest
from scipy.ndimage import label

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.edge_smoothing import smoothed_edges
from liquid_splash_addon.core.liquid.fields import AIR, Fields
from liquid_splash_addon.core.liquid.level_set import probability
from liquid_splash_addon.core.liquid.shaping import reshaped
from liquid_splash_addon.core.mesh.marching_cubes import surface

SHAPE = (64, 40, 24)
EDGE = 40.0
"""Cells along x at which the sheet ends."""


def sheet(doubt: float, cells: int = 128, noise: float = 0.4) -> Fields:
    """Return a sheet six cells thick in x and y that ends at EDGE.

    doubt : cells over which its level falls to nothing around there, with patches of 2^3 cells
    of noise; 0 for an edge that is sure.
    """
    grid = Grid.local(cells).crop((0, 0, 0), SHAPE)
    x, y, z = np.meshgrid(*(np.arange(n) + 0.5 for n in SHAPE), indexing="ij")
    flat = np.maximum(np.abs(z - SHAPE[2] / 2) - 3.0, np.abs(y - SHAPE[1] / 2) - 12.0)
    level = np.maximum(flat, x - EDGE)
    if doubt:
        patches = np.random.default_rng(0).normal(0, noise, [n // 2 for n in SHAPE])
        patches = patches.repeat(2, 0).repeat(2, 1).repeat(2, 2)
        unsure = np.abs(x - EDGE) < doubt
        level = np.where(unsure, np.maximum((x - EDGE) / doubt + patches, flat), level)
    level = np.clip(level, -4, 4).astype(np.float32)
    velocity = np.ones((3, *SHAPE), dtype=np.float32)
    return Fields(probability(level), np.clip(level, -AIR, AIR), velocity, grid)


def copied(fields: Fields) -> Fields:
    """Return the same fields in arrays of their own."""
    arrays = (fields.occupancy, fields.distance, fields.velocity)
    return Fields(*(array.copy() for array in arrays), fields.grid)


def area(fields: Fields) -> float:
    """Return the area of the surface, cells."""
    mesh = surface(fields)
    a, b, c = (mesh.vertices[mesh.faces[:, n]] for n in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 / fields.grid.spacing**2)


def test_a_ragged_edge_becomes_smooth_and_its_specks_go():
    before = sheet(doubt=8)
    after = reshaped(copied(before), smoothed_edges)
    assert label(before.occupancy > 0.5)[1] > label(after.occupancy > 0.5)[1]
    straight = area(sheet(doubt=0))
    assert area(after) - straight < 0.5 * (area(before) - straight)


def test_the_volume_stays_and_all_fields_agree():
    before = sheet(doubt=8)
    after = reshaped(copied(before), smoothed_edges)
    wet = after.occupancy > 0.5
    assert wet.sum() == pytest.approx((before.occupancy > 0.5).sum(), rel=0.03)
    assert ((after.distance < 0) == wet).all()
    assert (after.velocity == before.velocity).all()


def test_new_liquid_has_a_velocity():
    """Where an edge moves out into cells for which the generator gave none."""
    before = sheet(doubt=8)
    velocity = before.velocity * (before.occupancy > 0.5)
    distance = np.where(before.occupancy > 0.5, before.distance, np.float32(AIR))
    before = Fields(before.occupancy, distance.astype(np.float32), velocity, before.grid)
    after = reshaped(before, smoothed_edges)
    wet = after.occupancy > 0.5
    assert (wet & ~(before.occupancy > 0.5)).any(), "some liquid is new"
    assert np.linalg.norm(after.velocity, axis=0)[wet].min() > 0


def test_what_is_sure_stays():
    before = sheet(doubt=8)
    after = reshaped(copied(before), smoothed_edges)
    away = np.arange(SHAPE[0]) + 0.5 < EDGE - 12
    changed = np.abs(after.occupancy - before.occupancy)[away]
    assert ((after.occupancy > 0.5) == (before.occupancy > 0.5))[away].all()
    assert changed.max() < 0.2
    sure = sheet(doubt=0)
    kept = reshaped(copied(sure), smoothed_edges)
    moved = (kept.occupancy > 0.5) != (sure.occupancy > 0.5)
    assert moved.sum() < 0.02 * (sure.occupancy > 0.5).sum()


def test_drafts_and_air_are_left_alone():
    for fields in (sheet(doubt=8, cells=64), sheet(doubt=0)):
        if fields.grid.spacing < 0.004:
            fields = Fields(0 * fields.occupancy, 0 * fields.distance + AIR, fields.velocity,
                            fields.grid)  # fmt: skip
        before = copied(fields)
        assert reshaped(fields, smoothed_edges) is fields
        assert (fields.occupancy == before.occupancy).all()
        assert (fields.distance == before.distance).all()
