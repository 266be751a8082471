# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading strokes: their speed, their place, their pressure."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector

from liquid_splash_addon.blender.scene.grease_pencil import read_drawings
from liquid_splash_addon.blender.scene.places import rigid_matrix
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import Drawing, strokes_from_drawings
from liquid_splash_addon.core.sketch.local_frame import fit_frame
from tests.blender.sketching import add_sketch, bend, fan, line, slower

SOMEWHERE = Matrix.LocRotScale(Vector((3, -2, 1)), Euler((0.4, -0.8, 1.9)), None)


def read(sketch: bpy.types.Object) -> list[Drawing]:
    """Return the sketch's drawings once Blender knows where everything is."""
    bpy.context.view_layer.update()
    return read_drawings(sketch)[0]


def strokes_of(sketch: bpy.types.Object):
    """Return the sketch's strokes with the velocities estimated from their recorded times."""
    strokes, warnings = strokes_from_drawings(read(sketch), SplashSettings())
    assert not warnings
    return strokes


@pytest.mark.parametrize("speed", [0.2, 1.0, 7.0])
def test_constant_speed_is_found_within_5_percent(speed):
    for stroke in strokes_of(add_sketch([line((0, 0, 0), (1, 2, 0.5), speed), bend(speed)])):
        found = np.linalg.norm(stroke.velocities, axis=1)
        assert np.abs(found / speed - 1).max() < 0.05


def test_constant_speed_is_found_in_clumped_times():
    """Blender notes when it handles an event, not when the pen moved."""
    drawn = bend(1.5, points=300)
    clumped = Drawing(drawn.points, np.ceil(drawn.times / 0.008) * 0.008)
    found = np.linalg.norm(strokes_of(add_sketch([clumped]))[0].velocities, axis=1)
    assert abs(np.median(found) / 1.5 - 1) < 0.05


def test_half_the_speed_gives_half_the_input_speed():
    inputs = []
    for drawings in (fan(), slower(fan(), 2)):
        strokes = strokes_of(add_sketch(drawings))
        frame = fit_frame(strokes, SplashSettings().real_size)
        inputs.append(frame.strokes_to_local(strokes, SplashSettings().speed_gain))
    for fast, slow in zip(*inputs, strict=True):
        np.testing.assert_allclose(slow.velocities, fast.velocities / 2, rtol=1e-4, atol=1e-5)
        np.testing.assert_allclose(slow.points, fast.points, atol=1e-6)


def test_drawing_space_is_the_sketch_without_its_scale():
    drawn = bend()
    here, there = (read(add_sketch([drawn], m))[0] for m in (Matrix(), SOMEWHERE))
    np.testing.assert_allclose(here.points, drawn.points, atol=1e-5)
    np.testing.assert_allclose(there.points, drawn.points, atol=1e-5)
    large = read(add_sketch([drawn], SOMEWHERE @ Matrix.Diagonal((2, 3, 4, 1))))[0]
    np.testing.assert_allclose(large.points, drawn.points * (2, 3, 4), atol=1e-5)


def test_layers_are_where_blender_shows_them():
    sketch = add_sketch([line((0, 0, 0), (1, 0, 0))], SOMEWHERE)
    layer = sketch.data.layers[0]
    layer.translation, layer.scale, layer.rotation = (1, 2, 3), (2, 2, 2), (0, 0, np.pi / 2)
    points = read(sketch)[0].points
    np.testing.assert_allclose(points[[0, -1]], [(1, 2, 3), (1, 4, 3)], atol=1e-5)


def test_layers_follow_their_parents():
    sketch = add_sketch([line((0, 0, 0), (1, 0, 0))], SOMEWHERE)
    parent = bpy.data.objects.new("parent", None)
    bpy.context.collection.objects.link(parent)
    parent.matrix_world = Matrix.Translation((5, 0, 0))
    sketch.data.layers[0].parent = parent
    bpy.context.view_layer.update()
    layer = sketch.data.layers[0]
    expected = parent.matrix_world @ layer.matrix_parent_inverse @ Vector((1, 0, 0))
    tip = rigid_matrix(sketch) @ Vector(read(sketch)[0].points[-1])
    np.testing.assert_allclose(tip, expected, atol=1e-5)


def test_only_what_is_visible_at_this_frame_is_read():
    sketch = add_sketch(fan())
    hidden = sketch.data.layers.new("hidden")
    hidden.frames.new(1).drawing.add_strokes([5])
    hidden.hide = True
    sketch.data.layers.new("empty")
    drawings, warnings = read_drawings(sketch)
    assert len(drawings) == len(fan())
    assert warnings == ["Left out 1 hidden layer(s): show them to include them"]
    sketch.data.layers[0].frames.new(10).drawing.add_strokes([4, 4])
    bpy.context.scene.frame_set(12)
    assert [len(d.points) for d in read(sketch)] == [4, 4]
    bpy.context.scene.frame_set(0)
    assert read(sketch) == []


def test_strokes_without_times_are_untimed():
    sketch = add_sketch([])
    sketch.data.layers[0].frames[0].drawing.add_strokes([3])
    (drawing,) = read(sketch)
    assert drawing.times is None and not drawing.is_timed and drawing.pressures is None
    timeless = add_sketch([Drawing(bend().points)])
    assert not read(timeless)[0].is_timed


def test_pressure_is_thickness_within_the_sketch():
    sketch = add_sketch([line((0, 0, 0), (1, 0, 0), pressure=p) for p in (0.25, 0.5)])
    thin, thick = (drawing.pressures for drawing in read(sketch))
    np.testing.assert_allclose(thin, 0.5, rtol=1e-5)
    np.testing.assert_allclose(thick, 1.0, rtol=1e-5)
    assert read(add_sketch([line((0, 0, 0), (1, 0, 0), pressure=0.3)]))[0].pressures is None


def test_cyclic_strokes_are_closed():
    sketch = add_sketch([Drawing(np.eye(3), np.array([0.0, 1.0, 2.0]))])
    sketch.data.layers[0].frames[0].drawing.strokes[0].cyclic = True
    (drawing,) = read(sketch)
    np.testing.assert_allclose(drawing.points[-1], drawing.points[0])
    np.testing.assert_allclose(drawing.times, [0, 1, 2, 3], rtol=1e-6)


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        ([0, 1, 2, 3], [0, 1, 2, 3]),
        ([3, 2, 1.5, 0], [0, 1, 1.5, 3]),
        ([0, 1, 2, 0, 1, 3], [0, 1, 2, 3, 4, 6]),
    ],
    ids=["drawn", "direction switched", "joined"],
)
def test_times_go_forward(times, expected):
    points = np.arange(len(times))[:, None] * (1.0, 0.0, 0.0)
    (drawing,) = read(add_sketch([Drawing(points, np.array(times))]))
    np.testing.assert_allclose(drawing.times, expected, rtol=1e-6)


def test_bezier_strokes_are_bent():
    """A quarter of a circle by its usual handles."""
    sketch = add_sketch([Drawing(np.array([(1.0, 0, 0), (0, 1, 0)]), np.array([0.0, 1.0]))])
    drawing = sketch.data.layers[0].frames[0].drawing
    drawing.set_types(type="BEZIER")
    handle = 0.5523
    for name, values in (
        ("handle_left", [(1, -handle, 0), (handle, 1, 0)]),
        ("handle_right", [(1, handle, 0), (-handle, 1, 0)]),
    ):
        attribute = drawing.attributes.get(name) or drawing.attributes.new(
            name, "FLOAT_VECTOR", "POINT"
        )
        attribute.data.foreach_set("vector", np.ravel(values).astype(np.float32))
    (read_back,) = read(sketch)
    np.testing.assert_allclose(np.linalg.norm(read_back.points, axis=1), 1, atol=1e-3)
    np.testing.assert_allclose(read_back.times, np.linspace(0, 1, len(read_back.points)), atol=1e-6)


def test_nurbs_strokes_are_bent_and_keep_their_times():
    """Through 4 points of order 4 and uniform knots, a curve ends at a mean of three of them."""
    points = np.array([(0.0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    sketch = add_sketch([Drawing(points, np.arange(4.0))])
    sketch.data.layers[0].frames[0].drawing.set_types(type="NURBS")
    (drawing,) = read(sketch)
    expected = np.array([1, 4, 1]) / 6 @ points[:3]
    np.testing.assert_allclose(drawing.points[0], expected, atol=1e-6)
    np.testing.assert_allclose(drawing.times[[0, -1]], [1, 2], atol=1e-6)
    assert not read_drawings(sketch)[1]
