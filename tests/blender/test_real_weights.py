# SPDX-License-Identifier: GPL-3.0-or-later
"""The bundled weights, on the example sketches, through the button."""

import numpy as np
import pytest
from mathutils import Vector
from scipy.spatial import cKDTree

from liquid_splash_addon.blender.data.frame_text import frame_from_text
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from liquid_splash_addon.core.sketch.presets import SKETCHES, example_sketch
from liquid_splash_addon.core.sketch.strokes import resample
from tests.blender.sketching import add_sketch, generate, real_velocities, vertices

pytestmark = pytest.mark.once

RESOLUTIONS = ("64", "128")


@pytest.mark.parametrize("resolution", RESOLUTIONS)
@pytest.mark.parametrize("name", SKETCHES)
def test_velocity_at_the_strokes_is_the_drawn_one(name, resolution):
    """Gain times the drawn velocity, in object space, at the surface nearest to each stroke."""
    add_sketch(example_sketch(name))
    settings = SplashSettings()
    splash = generate(resolution=resolution, speed_gain=settings.speed_gain)
    strokes, _ = strokes_from_drawings(example_sketch(name), settings)
    dense = [resample(stroke, 0.02) for stroke in strokes]
    drawn = settings.speed_gain * np.concatenate([stroke.velocities for stroke in dense])
    _, nearest = cKDTree(vertices(splash)).query(np.concatenate([s.points for s in dense]))
    found = real_velocities(splash)[nearest]
    sizes = [np.linalg.norm(velocity, axis=1) for velocity in (drawn, found)]
    cosine = (drawn * found).sum(axis=1) / np.maximum(sizes[0] * sizes[1], 1e-9)
    assert abs(np.median(sizes[1]) / np.median(sizes[0]) - 1) < 0.3
    assert cosine.mean() > 0.7


@pytest.mark.parametrize("name", SKETCHES)
def test_the_splash_follows_the_strokes(name):
    """Most of the strokes lie in the liquid, or within two cells of it."""
    add_sketch(example_sketch(name))
    splash = generate(resolution="128", speed_gain=SplashSettings().speed_gain)
    cell = Grid.local().spacing / frame_from_text(splash.splash.frame).scale.length
    points = np.concatenate([drawing.points for drawing in example_sketch(name)])
    near = []
    for point in points:
        _, surface, normal, _ = splash.closest_point_on_mesh(point)
        offset = Vector(point) - surface
        near.append(offset.dot(normal) < 0 or offset.length < 2 * cell)
    assert np.mean(near) > 0.8


def test_a_format_that_this_device_does_not_have_gives_way():
    """As in a file from another machine."""
    from liquid_splash_addon.blender.jobs import loaded_generator
    from liquid_splash_addon.core.generator.precision import PRECISIONS

    generator = loaded_generator.get(None, "CPU", "float8")
    again = loaded_generator.get(None, "CPU", generator.precision)
    loaded_generator.free()
    assert generator.precision in PRECISIONS and again is generator
