# SPDX-License-Identifier: GPL-3.0-or-later
"""Curve objects as strokes: the shape is Blender's own, the speed comes from what they carry."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from scipy.spatial import cKDTree

from liquid_splash_addon.blender.scene.stroke_objects import read_object
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from liquid_splash_addon.core.sketch.strokes import arc_length
from tests.blender.sketching import add_sketch, fan, generate, splashes, vertices

PATH = [(0, 0, 0), (1, 0.4, 0.2), (1.6, -0.3, 0.5), (2.4, 0.2, 0.1), (3, 1, 0.3), (3.5, 0, 0)]
"""Points of a curve with bends."""


def link(name: str, data: bpy.types.ID, matrix: Matrix | None = None) -> bpy.types.Object:
    item = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(item)
    item.matrix_world = matrix or Matrix()
    bpy.context.view_layer.objects.active = item
    bpy.context.view_layer.update()
    return item


def old_curve(kind="POLY", path=PATH, radii=None, matrix=None, **options) -> bpy.types.Object:
    """Return a Curve object with one spline."""
    data = bpy.data.curves.new("curve", "CURVE")
    data.dimensions = "3D"
    data.resolution_u = 32
    spline = data.splines.new(kind)
    points = spline.bezier_points if kind == "BEZIER" else spline.points
    points.add(len(path) - 1)
    for n, (point, place) in enumerate(zip(points, path, strict=True)):
        point.co = place if kind == "BEZIER" else (*place, 1 + 0.5 * (n % 2))
        point.radius = 1.0 if radii is None else radii[n]
        if kind == "BEZIER":
            point.handle_left_type = point.handle_right_type = "AUTO"
    for name, value in options.items():
        setattr(spline, name, value)
    return link("Curve", data, matrix)


def new_curves(path=PATH, count=1, matrix=None, **attributes) -> bpy.types.Object:
    """Return a Curves object (the type of hair) of ``count`` curves, one above the other."""
    data = bpy.data.hair_curves.new("curves")
    data.add_curves([len(path)] * count)
    points = np.concatenate([np.array(path) + (0, 0, 0.2 * n) for n in range(count)])
    values = {"position": points} | attributes
    for name, given in values.items():
        given = np.asarray(given, dtype=np.float32)
        kind, field = ("FLOAT_VECTOR", "vector") if given.ndim == 2 else ("FLOAT", "value")
        made = data.attributes.get(name) or data.attributes.new(name, kind, "POINT")
        made.data.foreach_set(field, given.ravel())
    return link("Curves", data, matrix)


def read(item, modifiers=False):
    """Return an object's drawings; no warnings are allowed."""
    bpy.context.view_layer.update()
    drawings, warnings = read_object(item, modifiers=modifiers)
    assert not [said for said in warnings if not said.startswith("Modifiers do not count")]
    return drawings


def distance(points, others):
    """Return the farthest that a point of one polyline is from the other, both ways."""
    dense = [
        np.stack([np.interp(np.linspace(0, a[-1], 20_000), a, p[:, k]) for k in range(3)], axis=1)
        for p in (points, others)
        for a in (arc_length(p),)
    ]
    one, other = cKDTree(dense[0]).query(dense[1])[0], cKDTree(dense[1]).query(dense[0])[0]
    return max(one.max(), other.max())


def blenders_own(item) -> np.ndarray:
    """Return the vertices of the mesh that Blender makes of a curve, in order."""
    evaluated = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    found = np.array([vertex.co for vertex in mesh.vertices])
    evaluated.to_mesh_clear()
    return found


@pytest.mark.parametrize("is_cyclic", (False, True))
@pytest.mark.parametrize(
    "options",
    [
        {"kind": "POLY"},
        {"kind": "BEZIER"},
        *(
            {"kind": "NURBS", "order_u": order, "use_endpoint_u": ends, "use_bezier_u": pieces}
            for order, ends, pieces in (
                (4, False, False), (4, True, False), (3, False, False), (3, True, False),
                (3, False, True), (3, True, True), (5, True, False),
            )
        ),
    ],
)  # fmt: skip
def test_a_curve_has_the_shape_that_blender_gives_it(options, is_cyclic):
    if is_cyclic and options.get("use_bezier_u"):
        pytest.skip("pieces need a number of points that fits")
    item = old_curve(**options, use_cyclic_u=is_cyclic)
    (drawing,) = read(item)
    expected = blenders_own(item)
    expected = np.vstack([expected, expected[:1]]) if is_cyclic else expected
    assert distance(drawing.points, expected) < 0.02
    (changed,) = read_object(item, modifiers=True)[0]
    np.testing.assert_allclose(changed.points, drawing.points, atol=1e-6)
    item.modifiers.new("nothing", "WAVE").show_viewport = False
    (changed,) = read(item, modifiers=True)
    np.testing.assert_allclose(changed.points, drawing.points, atol=1e-5)


def curve_to_mesh() -> bpy.types.NodeTree:
    """Return nodes that turn curves into a mesh of their evaluated points."""
    tree = bpy.data.node_groups.new("to mesh", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    node = tree.nodes.new("GeometryNodeCurveToMesh")
    tree.links.new(start.outputs[0], node.inputs[0])
    tree.links.new(node.outputs[0], end.inputs[0])
    return tree


def test_hair_is_bent_as_blender_bends_it():
    item = new_curves()
    (drawing,) = read(item)
    item.modifiers.new("mesh", "NODES").node_group = curve_to_mesh()
    bpy.context.view_layer.update()
    evaluated = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    geometry = evaluated.evaluated_geometry()
    expected = np.array([vertex.co for vertex in geometry.mesh.vertices])
    assert len(expected) > 3 * len(PATH)
    assert distance(drawing.points, expected) < 0.01
    (wire,) = read(item, modifiers=True)
    np.testing.assert_allclose(wire.points, expected, atol=1e-6)


def test_modifiers_count_on_request():
    item = old_curve()
    item.modifiers.new("cast", "CAST").factor = 1.0
    item.data.splines[0].use_cyclic_u = True
    plain, cast = read(item)[0], read(item, modifiers=True)[0]
    np.testing.assert_allclose(plain.points, [*PATH, PATH[0]], atol=1e-6)
    expected = blenders_own(item)
    np.testing.assert_allclose(cast.points, [*expected, expected[0]], atol=1e-6)
    assert np.abs(cast.points - plain.points).max() > 0.1
    sketch = add_sketch(fan())
    thick = sketch.modifiers.new("offset", "GREASE_PENCIL_OFFSET")
    thick.location = (0, 0, 5)
    bpy.context.view_layer.update()
    assert read(sketch)[0].points[:, 2].max() < 1 and read(sketch, True)[0].points[:, 2].min() > 4


def test_a_beveled_curve_is_read_as_its_own_line():
    item = old_curve()
    item.data.bevel_depth = 0.1
    item.modifiers.new("smooth", "SMOOTH")
    bpy.context.view_layer.update()
    drawings, warnings = read_object(item, modifiers=True)
    np.testing.assert_allclose(drawings[0].points, PATH, atol=1e-6)
    assert "read without them" in warnings[0]


def test_curves_are_read_in_edit_mode_as_they_are_there():
    item = old_curve()
    bpy.ops.object.mode_set(mode="EDIT")
    item.data.splines[0].points[0].co = (9, 9, 9, 1)
    assert read(item)[0].points[0].tolist() == [9, 9, 9]
    bpy.ops.object.mode_set(mode="OBJECT")


def speeds(item, source, **settings):
    """Return the speeds of an object's strokes, m/s at a real size of one metre a unit."""
    drawings = read(item)
    chosen = SplashSettings(speed_source=source, real_size=0.0, **settings)
    strokes, warnings = strokes_from_drawings(drawings, chosen)
    return [np.linalg.norm(s.velocities, axis=1) for s in strokes], warnings


def test_speed_is_an_attribute_the_radius_or_constant():
    given = np.linspace(0.5, 2, len(PATH))
    item = new_curves(speed=given, radius=given)
    (found,), warnings = speeds(item, "ATTRIBUTE")
    np.testing.assert_allclose(found[::12], given, rtol=1e-5)
    assert warnings == []
    (found,), warnings = speeds(item, "PRESSURE", stroke_speed=2.0)
    np.testing.assert_allclose(found[::12], given, rtol=1e-5)
    assert warnings == []
    (found,), warnings = speeds(item, "CONSTANT", stroke_speed=0.7)
    np.testing.assert_allclose(found, 0.7, rtol=1e-5)
    (found,), warnings = speeds(item, "TIME", stroke_speed=0.7)
    np.testing.assert_allclose(found, 0.7, rtol=1e-5)
    assert "1 of 1 strokes have no recorded time" in warnings[0]


def test_a_vector_is_as_fast_as_it_is_long_and_grows_with_the_object():
    vectors = np.tile((3.0, 0, 4.0), (len(PATH), 1))
    (found,), _ = speeds(new_curves(speed=vectors), "ATTRIBUTE")
    np.testing.assert_allclose(found, 5, rtol=1e-5)
    (found,), _ = speeds(new_curves(speed=vectors, matrix=Matrix.Scale(2, 4)), "ATTRIBUTE")
    np.testing.assert_allclose(found, 10, rtol=1e-5)


def test_an_attribute_takes_its_place_before_times_and_times_stand_in_for_it():
    sketch = add_sketch(fan(speed=2.0))
    found, _ = speeds(sketch, "ATTRIBUTE")
    np.testing.assert_allclose(np.concatenate(found), 2, rtol=0.05)
    drawing = sketch.data.layers[0].frames[0].drawing
    drawing.attributes.new("speed", "FLOAT", "POINT")
    drawing.attributes["speed"].data.foreach_set("value", np.full(360, 3, dtype=np.float32))
    found, warnings = speeds(sketch, "ATTRIBUTE")
    np.testing.assert_allclose(np.concatenate(found), 3, rtol=1e-5)
    assert warnings == []


def test_radii_of_an_old_curve_are_its_pressure():
    item = old_curve(radii=np.linspace(0.2, 1, len(PATH)))
    (found,), warnings = speeds(item, "PRESSURE", stroke_speed=1.0)
    np.testing.assert_allclose(found, np.linspace(0.2, 1, len(PATH)), rtol=1e-5)
    assert warnings == []


@pytest.mark.usefixtures("tubes")
@pytest.mark.parametrize("make", (old_curve, lambda: old_curve("BEZIER"), new_curves))
def test_a_selected_curve_becomes_a_splash_and_is_followed(make):
    item = make()
    splash = generate()
    assert splash.splash.sketch == item and len(splash.data.polygons) > 500
    assert np.ptp(vertices(splash), axis=0)[0] > 3
    assert "no recorded time" in splash.splash.warnings
    bpy.context.view_layer.objects.active = splash
    before = splash.splash.made_of
    item.scale = (1, 1, 4)
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    assert splash.splash.made_of != before and splashes() == [splash]
    bpy.context.view_layer.objects.active = item
    assert bpy.ops.splash.generate() == {"FINISHED"} and splashes() == [splash]


@pytest.mark.usefixtures("tubes")
def test_curves_have_no_layers():
    old_curve()
    with pytest.raises(RuntimeError, match="Curves have no layers"):
        bpy.ops.splash.generate_layers()


@pytest.mark.parametrize("make", (old_curve, new_curves))
def test_curves_that_cannot_be_used_are_selected(make):
    item = make(path=[(1, 1, 1)] * 3)
    assert bpy.ops.splash.select_strokes() == {"FINISHED"}
    assert item.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
