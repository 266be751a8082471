# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools on strokes in Blender: which strokes, which axes, and that nothing else of them is lost."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix, Vector

from liquid_splash_addon.blender.scene.grease_pencil import (
    drawn_strokes,
    layer_matrix,
    read_drawings,
)
from liquid_splash_addon.blender.scene.sketch import add_strokes
from liquid_splash_addon.blender.ui import stroke_tools
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import Drawing, strokes_from_drawings
from liquid_splash_addon.core.sketch.tools import TOOLS
from tests.blender.drawing_panels import drawn
from tests.blender.sketching import add_sketch, bend, fan, generate, line

EXACT = {"dip": 0.0, "lean": 0.0, "variation": 0.0}
SOMEWHERE = Matrix.LocRotScale(Vector((3, -2, 1)), Euler((0.4, -0.8, 1.9)), Vector((2, 1, 0.5)))


@pytest.fixture(autouse=True)
def empty_scene():
    """Begin in Object Mode, without objects."""
    if bpy.context.active_object is not None and bpy.context.active_object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    bpy.context.scene.cursor.location = (0, 0, 0)
    yield
    if bpy.context.active_object is not None and bpy.context.active_object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def use(name: str, **settings: object) -> set[str]:
    """Run a tool's operator."""
    bpy.context.view_layer.update()
    return getattr(bpy.ops.splash, f"stroke_{name}")(**settings)


def strokes_of(sketch: bpy.types.Object, layer: int = 0) -> list:
    """Return the raw strokes of a layer."""
    return list(drawn_strokes(sketch.data.layers[layer]))


def in_world(sketch: bpy.types.Object, layer: int = 0) -> list[np.ndarray]:
    """Return the points of a layer's strokes in the world."""
    bpy.context.view_layer.update()
    matrix = layer_matrix(sketch, sketch.data.layers[layer])
    return [s.points @ matrix[:3, :3].T + matrix[:3, 3] for s in strokes_of(sketch, layer)]


def drawing_of(sketch: bpy.types.Object, layer: int = 0):
    return sketch.data.layers[layer].current_frame().drawing


def set_values(drawing, name: str, kind: str, domain: str, values) -> None:
    """Write an attribute."""
    attribute = drawing.attributes.get(name) or drawing.attributes.new(name, kind, domain)
    field = {"FLOAT_VECTOR": "vector", "FLOAT_COLOR": "color"}.get(kind, "value")
    attribute.data.foreach_set(field, np.ravel(values))


def values_of(drawing, name: str, width: int = 1, field: str = "value") -> np.ndarray:
    """Read an attribute."""
    data = drawing.attributes[name].data
    found = np.empty((len(data), width), dtype=np.float32)
    data.foreach_get(field, found.ravel())
    return found.squeeze()


def select(sketch: bpy.types.Object, numbers, layer: int = 0) -> None:
    """Select strokes of a layer alone."""
    for number, stroke in enumerate(drawing_of(sketch, layer).strokes):
        stroke.select = number in numbers


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT", "PAINT_GREASE_PENCIL"])
def test_every_tool_works_in_every_mode(mode):
    for name in TOOLS:
        sketch = add_sketch(fan())
        bpy.ops.object.mode_set(mode=mode)
        assert use(name.lower()) == {"FINISHED"}, name
        assert sketch.mode == mode
        assert len(strokes_of(sketch)) > 0
        bpy.ops.object.mode_set(mode="OBJECT")


def test_spin_is_around_the_cursor_in_the_world_wherever_the_sketch_stands():
    bpy.context.scene.cursor.location = (1, 2, 0)
    sketch = add_sketch([], SOMEWHERE)
    bpy.context.view_layer.update()
    inverse = np.linalg.inv(np.array(sketch.matrix_world, dtype=float))
    profile = line((2, 2, 0), (3, 2, 1))
    own = profile.points @ inverse[:3, :3].T + inverse[:3, 3]
    add_strokes(sketch, [Drawing(own, profile.times)])
    assert use("spin", count=6, **EXACT) == {"FINISHED"}
    found = in_world(sketch)
    assert len(found) == 6
    for n, points in enumerate(found):
        x, y, z = (points - (1, 2, 0)).T
        np.testing.assert_allclose(np.hypot(x, y), np.linspace(1, 2, 60), atol=1e-5)
        angle = n * np.pi / 3
        np.testing.assert_allclose(x, np.cos(angle) * np.hypot(x, y), atol=1e-5)
        np.testing.assert_allclose(y, np.sin(angle) * np.hypot(x, y), atol=1e-5)
        np.testing.assert_allclose(z, np.linspace(0, 1, 60), atol=1e-5)
    for stroke in strokes_of(sketch):
        np.testing.assert_allclose(stroke.times, profile.times, atol=1e-6)


def test_local_axes_and_the_objects_origin():
    sketch = add_sketch([line((1, 0, 0), (2, 0, 0))], SOMEWHERE)
    assert use("mirror", axis="X", space="LOCAL", pivot="ORIGIN") == {"FINISHED"}
    first, second = (stroke.points for stroke in strokes_of(sketch))
    np.testing.assert_allclose(second, first * (-1, 1, 1), atol=1e-5)


def test_the_centre_of_the_strokes():
    sketch = add_sketch([line((1, 0, 0), (2, 0, 0))])
    use("mirror", axis="X", pivot="CENTRE", keep=False)
    (points,) = in_world(sketch)
    np.testing.assert_allclose(points[:, 0], np.linspace(2, 1, 60), atol=1e-6)


def test_view_axes_need_a_view():
    add_sketch([line((1, 0, 0), (2, 0, 0))])
    if bpy.app.background:
        with pytest.raises(RuntimeError, match="choose Global or Local axes"):
            use("spin", space="VIEW")


def test_only_selected_strokes_are_changed_and_the_order_stays():
    sketch = add_sketch([line((0, 0, y), (1, 0, y)) for y in range(3)])
    bpy.ops.object.mode_set(mode="EDIT")
    select(sketch, {1})
    use("reverse")
    starts = [points[0, 0] for points in in_world(sketch)]
    assert starts == [0, 1, 0]
    assert [stroke.select for stroke in drawing_of(sketch).strokes] == [False, True, False]
    use("spin", count=3, **EXACT)
    heights = [points[0, 2] for points in in_world(sketch)]
    assert heights == [0, 1, 1, 1, 2]
    assert [s.select for s in drawing_of(sketch).strokes] == [False, True, True, True, False]


def test_selected_strokes_count_in_object_mode_too():
    sketch = add_sketch([line((0, 0, y), (1, 0, y)) for y in range(3)])
    select(sketch, {2})
    use("reverse")
    assert [points[0, 0] for points in in_world(sketch)] == [0, 0, 1]


def two_layers() -> bpy.types.Object:
    """Return a sketch with a stroke on each of two layers, the first one active."""
    sketch = add_sketch([line((0, 0, 0), (1, 0, 0))])
    layer = sketch.data.layers.new("Second")
    layer.frames.new(bpy.context.scene.frame_current)
    add_strokes(sketch, [line((0, 0, 1), (1, 0, 1))], layer)
    sketch.data.layers.active = sketch.data.layers[0]
    return sketch


def test_without_a_selection_the_active_layer_is_meant():
    sketch = two_layers()
    use("reverse")
    assert in_world(sketch)[0][0, 0] == 1 and in_world(sketch, 1)[0][0, 0] == 0


def test_strokes_stay_on_their_layers():
    sketch = two_layers()
    bpy.ops.object.mode_set(mode="EDIT")  # where all are selected
    use("spin", count=4, **EXACT)
    assert [len(strokes_of(sketch, n)) for n in range(2)] == [2, 2]
    assert {points[0, 2] for points in in_world(sketch, 1)} == {1.0}


def test_locked_and_hidden_layers_are_left_out_and_said():
    for attribute in ("lock", "hide"):
        sketch = two_layers()
        bpy.ops.object.mode_set(mode="EDIT")
        setattr(sketch.data.layers[1], attribute, True)
        before = strokes_of(sketch, 1)[0].points.copy()
        chosen, said = stroke_tools.chosen_strokes(sketch)
        assert [stroke.layer for stroke in chosen] == ["Strokes"]
        assert said == ["Left out 1 selected stroke(s) in locked or hidden layers"]
        use("reverse")
        np.testing.assert_array_equal(strokes_of(sketch, 1)[0].points, before)
        bpy.ops.object.mode_set(mode="OBJECT")
        sketch.data.layers.active = sketch.data.layers[1]
        with pytest.raises(RuntimeError, match="it first"):
            use("reverse")


def test_locked_groups_lock_their_layers():
    sketch = add_sketch(fan())
    group = sketch.data.layer_groups.new("Group")
    sketch.data.layers.move_to_layer_group(sketch.data.layers[0], group)
    group.lock = True
    with pytest.raises(RuntimeError, match="is locked, unlock it first"):
        use("reverse")


def test_all_properties_of_strokes_and_points_come_along():
    sketch = add_sketch(
        [line((1, 0, 0), (2, 0, 0), points=5), line((1, 0, 1), (2, 0, 1), points=3)]
    )
    drawing = drawing_of(sketch)
    ramp = np.arange(8, dtype=np.float32)
    set_values(drawing, "radius", "FLOAT", "POINT", 0.01 + ramp / 100)
    set_values(drawing, "speed", "FLOAT", "POINT", 1 + ramp)
    set_values(drawing, "vertex_color", "FLOAT_COLOR", "POINT", np.outer(ramp, [0.1, 0.05, 0, 0.1]))
    set_values(drawing, "mine", "INT", "POINT", ramp.astype(np.int32))
    set_values(drawing, "material_index", "INT", "CURVE", np.array([2, 5], np.int32))
    set_values(drawing, "cyclic", "BOOLEAN", "CURVE", np.array([False, True]))
    use("spin", count=4, **EXACT)
    sizes = [len(stroke.points) for stroke in strokes_of(sketch)]
    assert sizes == [5, 5, 3, 3], "in the places of their sources"
    drawing = drawing_of(sketch)
    order = np.concatenate([np.arange(5)] * 2 + [np.arange(5, 8)] * 2)
    np.testing.assert_allclose(values_of(drawing, "radius"), 0.01 + order / 100, rtol=1e-5)
    np.testing.assert_allclose(values_of(drawing, "speed"), 1 + order, rtol=1e-5)
    np.testing.assert_allclose(
        values_of(drawing, "vertex_color", 4, "color")[:, 0], order * 0.1, rtol=1e-5
    )
    np.testing.assert_array_equal(values_of(drawing, "mine"), order)
    np.testing.assert_array_equal(values_of(drawing, "material_index"), [2, 2, 5, 5])
    np.testing.assert_array_equal(values_of(drawing, "cyclic"), [0, 0, 1, 1])


def test_resampling_interpolates_what_points_have():
    sketch = add_sketch([line((0, 0, 0), (4, 0, 0), speed=2, points=5)])
    set_values(drawing_of(sketch), "radius", "FLOAT", "POINT", np.linspace(0.1, 0.5, 5, dtype="f4"))
    use("resample", count=9, smooth=0.0)
    (stroke,) = strokes_of(sketch)
    np.testing.assert_allclose(stroke.radii, np.linspace(0.1, 0.5, 9), rtol=1e-5)
    np.testing.assert_allclose(stroke.times, np.linspace(0, 2, 9), rtol=1e-5)


def test_stored_speeds_of_a_scaled_sketch_stay_in_its_own_units():
    sketch = add_sketch([line((1, 0, 0), (2, 0, 0))], Matrix.Diagonal((3, 3, 3, 1)))
    set_values(drawing_of(sketch), "speed", "FLOAT", "POINT", np.full(60, 2.0, np.float32))
    use("spin", count=5, **EXACT)
    np.testing.assert_allclose(values_of(drawing_of(sketch), "speed"), 2.0, rtol=1e-5)


def test_splines_become_polylines():
    corners = np.array([(1.0, 0, 0), (2, 0, 0), (2, 0, 1), (3, 0, 2)])
    sketch = add_sketch([Drawing(corners, np.arange(4.0))])
    drawing_of(sketch).set_types(type="NURBS")
    assert use("spin", count=3, **EXACT) == {"FINISHED"}
    for stroke in strokes_of(sketch):
        assert stroke.curve_type == 1 and len(stroke.points) > 4


def test_what_stands_in_the_way_is_said_and_nothing_changes():
    with pytest.raises(RuntimeError, match="Select a Grease Pencil sketch"):
        use("spin")
    sketch = add_sketch([])
    with pytest.raises(RuntimeError, match="Draw a stroke first"):
        use("spin")
    add_strokes(sketch, [line((0, 0, 0), (0, 1, 0))])
    with pytest.raises(RuntimeError, match="Fill needs 2 strokes"):
        use("fill")
    with pytest.raises(RuntimeError, match="lie in the mirror"):
        use("mirror", axis="X")
    assert len(strokes_of(sketch)) == 1
    sketch = add_sketch([Drawing(np.zeros((4, 3)))])
    with pytest.raises(RuntimeError, match="None of these strokes has a length"):
        use("reverse")
    with_dot = add_sketch([Drawing(np.zeros((4, 3))), bend()])
    assert use("reverse") == {"FINISHED"}
    assert len(strokes_of(with_dot)) == 2, "a dot stays as it is"


def test_undo_takes_back_a_tool():
    sketch = add_sketch([line((1, 0, 0), (2, 0, 1))])
    name = sketch.name
    bpy.ops.ed.undo_push(message="Sketch")
    use("spin", count=7)
    bpy.ops.ed.undo_push(message="Spin")
    assert len(strokes_of(bpy.data.objects[name])) == 7
    bpy.ops.ed.undo()
    assert len(strokes_of(bpy.data.objects[name])) == 1
    bpy.ops.ed.redo()
    assert len(strokes_of(bpy.data.objects[name])) == 7


def test_a_splash_is_made_of_what_tools_made(tubes):
    add_sketch([line((0.3, 0, 0), (1, 0, 0.9))])
    use("spin")
    splash = generate()
    assert "12" in splash.splash.summary or len(splash.data.vertices) > 0


def test_panel_and_menus_show_all_tools():
    add_sketch(fan())
    said = drawn(stroke_tools.SPLASH_PT_strokes)
    for name in TOOLS:
        assert f"splash.stroke_{name.lower()}" in said
    assert stroke_tools.SPLASH_PT_strokes.poll(bpy.context)
    assert len(stroke_tools.blender_menus()) >= 2


def speeds(sketch: bpy.types.Object) -> list[np.ndarray]:
    """Return the velocities along x that a splash of the sketch is made of."""
    bpy.context.view_layer.update()
    strokes, _ = strokes_from_drawings(read_drawings(sketch)[0], SplashSettings(real_size=0.0))
    return [stroke.velocities[:, 0] for stroke in strokes]


def test_strokes_remember_their_speed_through_tools_copies_and_files(tmp_path):
    sketch = add_sketch([line((0, 0, z), (4, 0, z), 2.0) for z in range(3)])
    bpy.ops.object.mode_set(mode="EDIT")
    select(sketch, {1})
    assert bpy.ops.splash.stroke_speed(multiplier=3.0) == {"FINISHED"}
    np.testing.assert_allclose([v.mean() for v in speeds(sketch)], [2, 6, 2], rtol=1e-3)
    select(sketch, {2})
    bpy.ops.splash.stroke_speed(backward=True, start=2.0, middle=1.0, end=0.5)
    slowing = -speeds(sketch)[2]
    np.testing.assert_allclose(slowing[[0, -1]], [4, 1], rtol=1e-3)
    select(sketch, {1, 2})
    use("reverse")
    assert speeds(sketch)[1].mean() < 0 < speeds(sketch)[2].mean()
    bpy.ops.object.mode_set(mode="OBJECT")
    add_strokes(sketch, [line((0, 0, 5), (4, 0, 5), 2.0)])
    np.testing.assert_allclose(speeds(sketch)[3], 2, rtol=1e-3)
    expected, name = speeds(sketch), sketch.name
    path = str(tmp_path / "speeds.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    with bpy.data.libraries.load(path) as (_, wanted):
        wanted.objects = [name]
    bpy.context.collection.objects.link(wanted.objects[0])
    for one, other in zip(speeds(wanted.objects[0]), expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6)


def test_values_of_another_hand_are_held_within_limits():
    sketch = add_sketch([line((0, 0, 0), (4, 0, 0), 2.0) for _ in range(3)])
    drawing = drawing_of(sketch)
    values = np.array([1e9, -5, np.nan], np.float32)
    set_values(drawing, "splash_speed", "FLOAT", "CURVE", values)
    found = [v.mean() for v in speeds(sketch)]
    np.testing.assert_allclose(found, [200, 2, 2], rtol=1e-3)
    drawing.attributes.remove(drawing.attributes["splash_speed"])
    drawing.attributes.new("splash_speed", "INT", "POINT")
    with pytest.raises(RuntimeError, match="of another type: remove it"):
        bpy.ops.splash.stroke_speed(multiplier=3.0)
