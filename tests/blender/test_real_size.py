# SPDX-License-Identifier: GPL-3.0-or-later
"""Real Size in Blender: any size is made, on its sketch, and the panel says what is computed."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from tests.blender.sketching import add_sketch, fan, generate, in_world, moved


@pytest.mark.parametrize("size", [0.02, 0.9, 12.0])
def test_any_size_is_made_on_its_sketch(size):
    add_sketch(fan())
    splash = generate(real_size=0.3)
    usual = in_world(splash)
    bpy.ops.splash.realign(real_size=size)
    assert "Froude" in splash.splash.regime
    assert "get no liquid" not in splash.splash.warnings
    np.testing.assert_allclose(
        in_world(splash).mean(axis=0), usual.mean(axis=0), atol=0.3 * np.ptp(usual)
    )
    assert np.ptp(in_world(splash), axis=0).max() < 1.3 * np.ptp(usual, axis=0).max()
    bpy.ops.splash.regenerate(real_size=0.3)
    assert splash.splash.regime == ""


def test_a_large_splash_follows_its_moved_strokes():
    add_sketch(fan())
    splash = generate(real_size=12.0)
    before = in_world(splash)
    far = moved(fan(), Matrix.Translation((50, 0, 0)))
    splash.splash.sketch = add_sketch(far, active=False)
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.regenerate()
    after = in_world(splash)
    size = np.ptp(before, axis=0).max()
    np.testing.assert_allclose(
        after.mean(axis=0), before.mean(axis=0) + np.array([50, 0, 0]), atol=1e-2 * size
    )
