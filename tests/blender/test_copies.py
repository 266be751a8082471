# SPDX-License-Identifier: GPL-3.0-or-later
"""Copies have drops and parts of their own."""

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.jobs import refine
from liquid_splash_addon.blender.scene.drop_points import own_points, points_of
from tests.blender.modelling import crossing, generate_layers
from tests.blender.sketching import add_sketch, fan, generate, vertices

pytestmark = pytest.mark.once


def duplicate(item: bpy.types.Object) -> bpy.types.Object:
    """Copy an object as Shift+D does, and return the copy."""
    for other in bpy.context.selected_objects:
        other.select_set(False)
    item.select_set(True)
    bpy.context.view_layer.objects.active = item
    assert bpy.ops.object.duplicate() == {"FINISHED"}
    return bpy.context.view_layer.objects.active


def positions(item: bpy.types.Object) -> np.ndarray:
    return vertices(item) if item is not None else np.zeros((0, 3))


def seeds_with_drops(splash: bpy.types.Object) -> list[int]:
    """Return two seeds by which drops fly free: which they are differs between libraries."""
    found, droplets = [], splash.splash_stack.items[0].droplets
    for droplets.seed in range(30):
        outcome = refine.compute(refine.task_of(splash), lambda stage, share: None)
        if len(outcome.drops.positions):
            found.append(droplets.seed)
        if len(found) == 2:
            break
    return found


def test_a_copied_splash_leaves_the_drops_of_the_original_alone(tubes):
    add_sketch(fan())
    splash = generate()
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    splash.splash_stack.items[0].droplets.amount = 0.02
    own, other = seeds_with_drops(splash)
    splash.splash_stack.items[0].droplets.seed = own
    bpy.ops.splash.drop_points()
    drops = positions(points_of(splash))
    assert len(drops)
    copy = duplicate(splash)
    assert own_points(copy) is None
    copy.splash_stack.items[0].droplets.seed = other
    np.testing.assert_array_equal(positions(points_of(splash)), drops)
    bpy.ops.splash.drop_points()
    assert points_of(copy) not in (None, points_of(splash))
    assert len(positions(points_of(copy)))
    np.testing.assert_array_equal(positions(points_of(splash)), drops)


def test_a_copy_with_its_drops_has_both(tubes):
    add_sketch(fan())
    splash = generate()
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    bpy.ops.splash.drop_points()
    drops = points_of(splash)
    drops.select_set(True)
    splash.select_set(True)
    bpy.context.view_layer.objects.active = splash
    bpy.ops.object.duplicate()
    copy = bpy.context.view_layer.objects.active
    assert points_of(copy) not in (None, drops) and points_of(splash) == drops


def test_a_copied_model_has_splashes_of_its_own(thick_drafts):
    model = generate_layers(crossing())
    parts = [part.splash for part in model.splash_model.parts]
    before = vertices(model)
    copy = duplicate(model)
    own = [part.splash for part in copy.splash_model.parts]
    assert len(own) == len(parts) and not set(own) & set(parts)
    assert all(item.splash.owner == copy and item.hide_viewport for item in own)
    np.testing.assert_array_equal(vertices(copy), before)
    own[0].location.x += 0.1
    bpy.ops.splash.model_update()
    assert np.abs(vertices(copy).max(axis=0) - before.max(axis=0)).max() > 0.01
    np.testing.assert_array_equal(vertices(model), before)
