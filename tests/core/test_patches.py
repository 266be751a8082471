# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches between strokes."""

import numpy as np
import pytest

from liquid_splash_addon.core.condition.channels import PATCH_CLOSENESS
from liquid_splash_addon.core.condition.patches import sampling
from liquid_splash_addon.core.condition.patches.gabriel import (
    MOST_POINTS,
    STEP,
    WIDEST,
    sample_points_of,
)
from liquid_splash_addon.core.condition.patches.sampling import QUALITIES
from liquid_splash_addon.core.grid import LOCAL_SPACING, Grid
from liquid_splash_addon.core.sketch.strokes import Stroke

from .sketching import condition_of, fan, line, patches_between


def lines(*offsets, length=0.1, speed=1.0):
    """Return strokes along x, side by side at these y."""
    return [line((0.0, y, 0.01), (length, y, 0.01), speed) for y in offsets]


def barrel(count, radius=0.06, length=0.2, bulge=0.0):
    """Return strokes along the sides of a barrel about z."""
    z = np.linspace(-length / 2, length / 2, 30)
    wide = radius + bulge * np.cos(np.pi * z / length)
    strokes = []
    for angle in 2 * np.pi * np.arange(count) / count:
        points = np.stack([wide * np.cos(angle), wide * np.sin(angle), z], axis=1)
        strokes.append(Stroke(points, np.tile([0.0, 0.0, 2.0], (len(z), 1))))
    return strokes


def test_two_strokes_side_by_side_have_patches_in_the_strip_between():
    points, values = patches_between(lines(0.0, 0.03))
    assert np.abs(points[:, 2] - 0.01).max() < 1e-4
    assert points[:, 0].min() > -0.001 and points[:, 0].max() < 0.101
    assert points[:, 1].min() > -0.001 and points[:, 1].max() < 0.031
    # All cells of the strip are met.
    cells = np.zeros((30, 8))
    np.add.at(cells, ((points[:, 0] * 299).astype(int), (points[:, 1] * 260).astype(int)), 1)
    assert (cells > 0).all()
    # The ball between them has a radius of 15 mm.
    assert np.median(values[:, 0]) == pytest.approx(1 - 0.015 / WIDEST, abs=0.02)
    assert values[:, 1].min() > 0.99 and values[:, 2].min() > 0.99
    np.testing.assert_allclose(
        values[:, QUALITIES:], np.tile([1.0, 0.0, 0.0], (len(values), 1)), atol=1e-5
    )


def test_strokes_too_far_apart_have_no_patches():
    assert not len(patches_between(lines(0.0, 2.2 * WIDEST))[0])
    assert len(patches_between(lines(0.0, 1.8 * WIDEST))[0])


def test_strokes_have_patches_to_their_neighbours_only():
    """With a third in the middle, but higher, none goes straight from the first to the last."""
    outer = lines(0.0, 0.05)
    middle = [line((0.0, 0.025, 0.03), (0.1, 0.025, 0.03))]
    points, _ = patches_between(outer + middle)
    inside = np.abs(points[:, 1] - 0.025) < 0.01
    assert inside.any() and points[inside, 2].min() > 0.014


def test_patches_are_curved_as_the_strokes_lie():
    """Flat, they would leave a barrel of 12 strokes by 2 mm; PN patches stay within 0.4 mm."""
    points, values = patches_between(barrel(12))
    sides = (np.abs(points[:, 2]) < 0.08) & (values[:, 0] > 0.5)  # not across the barrel
    away = np.hypot(points[:, 0], points[:, 1])[sides] - 0.06
    assert 0.06 * (1 - np.cos(np.pi / 12)) > 0.002
    assert np.abs(away).mean() < 0.0004 and np.abs(away).max() < 0.0008
    assert values[sides, 1].mean() > 0.95


def test_a_patch_across_the_sheet_is_less_fair():
    """Two sheets face each other; what joins them stands across both."""
    strokes = lines(*np.linspace(0, 0.06, 7)) + [
        line((0.0, y, 0.03), (0.1, y, 0.03)) for y in np.linspace(0, 0.06, 7)
    ]
    points, values = patches_between(strokes)
    between = np.abs(points[:, 2] - 0.02) < 0.008
    on = np.abs(points[:, 2] - 0.01) < 0.001
    assert between.any() and on.any()
    assert np.median(values[on, 1]) > 0.95 and np.median(values[between, 1]) < 0.75
    assert np.median(values[on, 0]) > np.median(values[between, 0])


def test_opposed_strokes_are_not_coherent():
    there, back = lines(0.0)[0], lines(0.03)[0]
    _, values = patches_between([there, Stroke(back.points, -back.velocities)])
    mixed = np.abs(values[:, QUALITIES]) < 0.9  # not along one stroke
    assert mixed.any() and values[mixed, 2].max() < 0.01
    _, values = patches_between([there, Stroke(back.points, 1.5 * back.velocities)])
    assert 0.5 < np.median(values[:, 2]) < 0.9
    assert values[:, QUALITIES].min() > 0.99 and values[:, QUALITIES].max() < 1.51


def test_patches_turn_with_the_strokes():
    turn, strokes = np.diag([1.0, -1.0, -1.0]), barrel(9, bulge=0.02)
    turned = [Stroke(s.points @ turn, s.velocities @ turn) for s in strokes]
    grid = Grid.local(64)
    cells, others = (
        condition_of(given, grid).dense()[PATCH_CLOSENESS] for given in (strokes, turned)
    )
    flipped = others[:, ::-1, ::-1]
    # Not across the barrel, where many triangles are as good.
    cells, flipped = (np.where(given > 0.5, given, 0) for given in (cells, flipped))
    assert ((cells > 0) == (flipped > 0)).mean() > 0.999
    assert np.abs(cells - flipped).mean() < 0.05 * cells.mean()


def test_patches_are_the_same_at_every_call():
    assert all(
        np.array_equal(a, b)
        for a, b in zip(patches_between(fan()), patches_between(fan()), strict=True)
    )


@pytest.mark.parametrize(
    "strokes",
    [
        lines(0.0),
        [line((0, 0, 0), (0.001, 0, 0), points=2)],
        [line((0, 0, 0), (0.001, 0, 0), points=2)] * 3,
        [Stroke(np.full((3, 3), 0.1), np.zeros((3, 3)))] * 4,
        [Stroke(s.points, 0 * s.velocities) for s in lines(0.0, 0.02)],
        lines(*np.linspace(0, 1e-6, 4)),
    ],
    ids=["one", "short", "equal", "points", "still", "close"],
)
def test_any_strokes_will_do(strokes):
    points, values = patches_between(strokes)
    assert np.isfinite(points).all() and np.isfinite(values).all()
    assert (values[:, :QUALITIES] >= 0).all() and (values[:, :QUALITIES] <= 1).all()
    assert np.isfinite(condition_of(strokes, Grid.local(64)).values).all()


def test_many_strokes_have_no_more_points():
    few, many = (
        sample_points_of(lines(0.0, 0.01)),
        sample_points_of(lines(*np.linspace(0, 1, 300), length=0.4)),
    )
    assert few.step == STEP and many.step > STEP
    assert len(many.points) < 1.3 * MOST_POINTS + 2 * 300


def test_samples_leave_no_cell_out():
    """With samples twice as dense, hardly a cell more is crossed."""
    strokes = barrel(10)
    grid = Grid.local()
    cells = (condition_of(strokes, grid).dense()[PATCH_CLOSENESS] > 0).sum()
    before = sampling.SAMPLE_SPACING
    sampling.SAMPLE_SPACING = before / 3
    try:
        more = (condition_of(strokes, grid).dense()[PATCH_CLOSENESS] > 0).sum()
    finally:
        sampling.SAMPLE_SPACING = before
    assert before < LOCAL_SPACING and cells > 0.93 * more
