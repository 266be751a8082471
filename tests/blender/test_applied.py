# SPDX-License-Identifier: GPL-3.0-or-later
"""Refinements that were applied stay, whatever is done afterwards."""

import bpy
import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.blender.sketching import add_sketch, fan, generate, vertices

pytestmark = [pytest.mark.once, pytest.mark.usefixtures("tubes")]


@pytest.fixture
def applied() -> bpy.types.Object:
    """A splash whose droplets were applied."""
    add_sketch(fan())
    splash = generate()
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    splash.splash_stack.items[0].droplets.amount = 0.02
    assert bpy.ops.splash.refinement_apply() == {"FINISHED"}
    return splash


def farthest(splash, before):
    """Return how far the surface is from where it was, Blender units: the 99th percentile."""
    away, _ = cKDTree(before).query(vertices(splash))
    return np.quantile(away, 0.99)


CELL = 0.4 / 64 / 0.32
"""Of the tests' drafts, Blender units."""


def test_apply_keeps_the_mesh_and_empties_the_list(applied):
    bare = vertices(applied)
    assert not applied.splash_stack.items and not applied.splash_stack.warnings
    bpy.ops.splash.refinement_update()
    np.testing.assert_array_equal(vertices(applied), bare)


def test_apply_moves_nothing_even_if_made_again():
    add_sketch(fan())
    splash = generate()
    bpy.ops.splash.refinement_preset(preset="FRESH")
    refined = vertices(splash)
    for change in (bpy.ops.splash.refinement_apply, bpy.ops.splash.refinement_update):
        change()
        np.testing.assert_array_equal(vertices(splash), refined)


def test_what_is_added_after_apply_comes_on_top(applied):
    drops = vertices(applied)
    bpy.ops.splash.refinement_add(kind="WAVES")
    assert farthest(applied, drops) < CELL, "the drops are still there"
    applied.splash_stack.items[0].show = False
    assert farthest(applied, drops) < 0.02 * CELL


def test_clearance_and_update_keep_what_was_applied(applied):
    drops = vertices(applied)
    applied.splash_obstacles.clearance = 1.0
    assert farthest(applied, drops) < 0.02 * CELL


def test_applied_waves_stay_too(applied):
    bpy.ops.splash.refinement_add(kind="WAVES")
    waves = vertices(applied)
    assert bpy.ops.splash.refinement_apply() == {"FINISHED"}
    bpy.ops.splash.refinement_update()
    assert len(vertices(applied)) == pytest.approx(len(waves), rel=0.05)
    assert farthest(applied, waves) < 0.5 * CELL


def test_applied_twice_and_saved(applied, tmp_path):
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    applied.splash_stack.items[0].droplets.seed = 4
    assert bpy.ops.splash.refinement_apply() == {"FINISHED"}
    both, name = vertices(applied), applied.name
    path = str(tmp_path / "applied.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    again = bpy.data.objects[name]
    bpy.ops.splash.refinement_update()
    assert farthest(again, both) < 0.02 * CELL


def test_regenerate_makes_it_without_them(applied):
    drops = vertices(applied)
    bpy.ops.splash.regenerate()
    assert len(vertices(applied)) < len(drops)
