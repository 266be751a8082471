# SPDX-License-Identifier: GPL-3.0-or-later
"""Far from the origin, tiny, huge, or in other units, a sketch gives the splash it always gives.

Splashes are compared in the space of their sketch, by the farthest that one surface is from the
other, over the size of the splash.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix
from scipy.spatial import cKDTree

from liquid_splash_addon.blender.data.refinements import add_step
from liquid_splash_addon.blender.scene import mesh_space
from liquid_splash_addon.core.refinement.settings import DropletSettings, WaveSettings
from tests.blender.sketching import add_sketch, fan, generate, line, moved, vertices
from tests.blender.test_curves import PATH, new_curves

pytestmark = pytest.mark.usefixtures("tubes")

SAME = 1e-4
"""Share of the splash's size."""

TURN = Euler((0.4, -0.7, 1.9)).to_matrix().to_4x4()
HERE = np.zeros(3)
FAR = [(5e5, -3e5, 2e5), (-4e6, 2e6, 1e6)]


def standing(place=HERE, turn: Matrix = TURN) -> Matrix:
    """Return a place of a turned sketch."""
    return Matrix.Translation(place) @ turn


def liquid(splash: bpy.types.Object) -> np.ndarray:
    """Return the vertices in the splash's drawing space."""
    inverse = np.linalg.inv(mesh_space.space_of(splash.data))
    return vertices(splash) @ inverse[:3, :3].T + inverse[:3, 3]


def assert_same(found: np.ndarray, wanted: np.ndarray) -> None:
    """Compare surfaces both ways."""
    size = np.ptp(wanted, axis=0).max()
    for one, other in ((found, wanted), (wanted, found)):
        away, _ = cKDTree(one).query(other)
        assert away.max() <= SAME * size


_usual: dict[str, np.ndarray] = {}
"""What each way gives where all is as usual."""


def usual(way: Callable[[Any], bpy.types.Object], given: Any) -> np.ndarray:
    """Return that, and an empty scene."""
    if way.__name__ not in _usual:
        _usual[way.__name__] = liquid(way(given))
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    return _usual[way.__name__]


def one_sketch(matrix: Matrix) -> bpy.types.Object:
    add_sketch(fan(), matrix)
    return generate()


def two_sketches(matrix: Matrix) -> bpy.types.Object:
    """The second one stands beside the first, at a place that is known exactly this far away."""
    beside = Matrix.Translation((0, 0, 0.5))
    second = add_sketch(fan()[:3], Matrix.Translation(matrix.translation) @ beside @ TURN)
    first = add_sketch(fan(), matrix)
    second.select_set(True)
    first.select_set(True)
    return generate()


def curves(matrix: Matrix) -> bpy.types.Object:
    new_curves(matrix=matrix)
    return generate(speed_source="CONSTANT")


def refined(matrix: Matrix) -> bpy.types.Object:
    splash = one_sketch(matrix)
    add_step(splash, DropletSettings(amount=0.02))
    add_step(splash, WaveSettings(reach=0.2))
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.regenerate()
    return splash


def made_again(matrix: Matrix) -> bpy.types.Object:
    """Regenerate and Refit to Sketch leave it where it is."""
    splash = one_sketch(matrix)
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.regenerate()
    bpy.ops.splash.realign()
    return splash


def with_obstacle(matrix: Matrix) -> bpy.types.Object:
    splash = one_sketch(matrix)
    collection = bpy.data.collections.new("Obstacles")
    bpy.context.scene.collection.children.link(collection)
    bpy.ops.mesh.primitive_cube_add(size=0.25)
    cube = bpy.context.active_object
    collection.objects.link(cube)
    cube.matrix_world = Matrix.Translation(matrix.translation) @ Matrix.Translation((0, 0.5, 0))
    splash.splash_obstacles.collection = collection
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.regenerate()
    return splash


WAYS = (one_sketch, two_sketches, curves, refined, made_again, with_obstacle)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("place", FAR)
def test_far_from_the_origin(way, place):
    wanted = usual(way, standing())
    splash = way(standing(place))
    assert_same(liquid(splash), wanted)
    bpy.context.view_layer.update()
    assert tuple(splash.matrix_world.translation) == tuple(Matrix.Translation(place).translation)


def test_moved_far_away_and_back():
    sketch = add_sketch(fan(), standing())
    splash = generate()
    wanted = liquid(splash)
    for place in (*FAR, HERE):
        sketch.matrix_world = standing(place)
        bpy.context.view_layer.objects.active = splash
        bpy.ops.splash.regenerate()
        assert_same(liquid(splash), wanted)
        away = np.array(splash.matrix_world.translation) - np.array(sketch.matrix_world.translation)
        assert np.abs(away).max() <= 2e-7 * max(np.abs(place).max(), 1)


@pytest.mark.parametrize("follows", [True, False])
def test_a_small_step_far_away_is_followed(follows):
    """At 5e5 single precision knows steps of 1/32: half a splash is not lost among them."""
    bpy.context.scene.splash.follow = follows
    sketch = add_sketch(fan(), Matrix.Translation((5e5, 0, 0)))
    splash = generate()
    sketch.location.x += 0.5
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.regenerate()
    assert splash.matrix_world.translation.x == 5e5 + 0.5


SIZES = (1e-4, 1e3)


def scaled_strokes(size: float, **settings) -> bpy.types.Object:
    """The strokes are as large, drawn in the same time."""
    add_sketch(moved(fan(), Matrix.Scale(size, 4)), standing())
    return generate(**settings)


def scaled_object(size: float, **settings) -> bpy.types.Object:
    """The object is."""
    add_sketch(fan(), standing() @ Matrix.Scale(size, 4))
    return generate(**settings)


def scaled_curves(size: float, **settings) -> bpy.types.Object:
    new_curves(size * np.array(PATH))
    return generate(speed_source="CONSTANT", **settings)


def scaled_and_refined(size: float, **settings) -> bpy.types.Object:
    splash = scaled_strokes(size, **settings)
    add_step(splash, DropletSettings(amount=0.02))
    add_step(splash, WaveSettings(reach=0.2))
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.regenerate()
    return splash


@pytest.mark.parametrize("way", [scaled_strokes, scaled_object, scaled_curves, scaled_and_refined])
@pytest.mark.parametrize("size", SIZES)
def test_tiny_and_huge_sketches(way, size):
    wanted = usual(way, 1.0)
    splash = way(size)
    assert_same(liquid(splash) / size, wanted)
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.regenerate()
    assert_same(liquid(splash) / size, wanted)
    assert not splash.splash.warnings


@pytest.mark.parametrize("size", SIZES)
def test_a_tiny_or_huge_splash_is_moved_and_realigned(size):
    splash = scaled_strokes(size)
    wanted = liquid(splash)
    sketch = splash.splash.sketch
    sketch.location.x += 3 * size
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.regenerate()
    assert_same(liquid(splash), wanted)
    assert splash.matrix_world.translation.x == pytest.approx(3 * size)


@pytest.mark.parametrize("real_size", [0.0, 0.32])
def test_the_units_of_the_scene_do_not_matter(real_size):
    """Real Size says how large a sketch is; without it, one unit is one metre."""
    drawings = moved(fan(speed=1.0), Matrix.Scale(0.3, 4))
    add_sketch(drawings)
    wanted = liquid(generate(real_size=real_size))
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.context.scene.unit_settings.scale_length = 0.01
    bpy.context.scene.unit_settings.system = "METRIC"
    add_sketch(drawings)
    np.testing.assert_array_equal(liquid(generate(real_size=real_size)), wanted)


def test_short_strokes_beside_long_ones_stay():
    """What is small is measured by the sketch, not by units."""
    size = 1e-4
    short = line((0, 0, 0.2 * size), (0.02 * size, 0, 0.22 * size), speed=size)
    add_sketch([*moved(fan(), Matrix.Scale(size, 4)), short])
    assert not generate().splash.warnings
