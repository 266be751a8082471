# SPDX-License-Identifier: GPL-3.0-or-later
"""Whatever gives triangles is an obstacle; what cannot be one is left out, with its name."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from tests.blender.sketching import add_sketch, fan, generate, in_world, vertices
from tests.blender.test_obstacles import closest

pytestmark = pytest.mark.usefixtures("tubes")

PLACE = (0.6, 0.0, 0.0)


def collection(*items: bpy.types.Object) -> bpy.types.Collection:
    """Return a new collection in the scene with these objects alone."""
    found = bpy.data.collections.new("Obstacles")
    bpy.context.scene.collection.children.link(found)
    for item in items:
        for home in [*item.users_collection]:
            home.objects.unlink(item)
        found.objects.link(item)
    bpy.context.view_layer.update()
    return found


def ball(radius: float = 0.3, place=PLACE) -> bpy.types.Object:
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, location=place)
    return bpy.context.active_object


def new(name: str, data=None) -> bpy.types.Object:
    return bpy.data.objects.new(name, data)


def bare_curve() -> bpy.types.Object:
    data = bpy.data.curves.new("Bare", "CURVE")
    data.splines.new("POLY").points.add(2)
    return new("Bare", data)


def loose_edges() -> bpy.types.Object:
    data = bpy.data.meshes.new("Loose")
    data.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    return new("Loose", data)


def broken_mesh() -> bpy.types.Object:
    data = bpy.data.meshes.new("Broken")
    data.from_pydata([(0, 0, 0), (1, 0, 0), (0, np.nan, 0)], [], [(0, 1, 2)])
    return new("Broken", data)


BAD = {
    "curve": bare_curve,
    "edges": loose_edges,
    "not a number": broken_mesh,
    "empty": lambda: new("Nothing"),
    "light": lambda: new("Lamp", bpy.data.lights.new("Lamp", "POINT")),
}
SAID = {"curve", "edges", "not a number"}
"""What is worth a warning: nobody takes a lamp for an obstacle."""


def made() -> bpy.types.Object:
    add_sketch(fan())
    return generate()


@pytest.mark.parametrize("kind", BAD)
def test_one_bad_obstacle_is_left_out_with_its_name(kind: str):
    splash = made()
    bad = BAD[kind]()
    splash.splash_obstacles.collection = collection(ball(), bad)
    assert closest(splash) > 0.29, "the good one counts"
    verdicts = dict(splash.splash_obstacles.listed)
    assert verdicts["Sphere"] == "solid" and verdicts[bad.name] != "solid"
    assert (f"'{bad.name}'" in splash.splash_stack.warnings) == (kind in SAID)
    assert bpy.ops.splash.select_named(name=bad.name) == {"FINISHED"}
    assert bpy.context.active_object == bad


def test_our_own_drops_and_splashes_are_no_obstacles():
    splash = made()
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    bpy.context.view_layer.objects.active = splash
    bpy.ops.splash.drop_points()
    plain = vertices(splash)
    splash.splash_obstacles.collection = collection(splash, splash.splash_stack.points)
    np.testing.assert_array_equal(vertices(splash), plain)
    assert not splash.splash_stack.warnings


def instanced_collection() -> bpy.types.Object:
    item = ball(0.3, (0, 0, 0))
    source = bpy.data.collections.new("Source")
    for home in [*item.users_collection]:
        home.objects.unlink(item)
    source.objects.link(item)
    found = new("Instance")
    found.instance_type, found.instance_collection, found.location = "COLLECTION", source, PLACE
    return found


def nested_instances() -> bpy.types.Object:
    inner = instanced_collection()
    source = bpy.data.collections.new("Outer")
    source.objects.link(inner)
    found = new("Nested")
    found.instance_type, found.instance_collection = "COLLECTION", source
    return found


def geometry_nodes() -> bpy.types.Object:
    """Return a single vertex on which nodes put a ball."""
    data = bpy.data.meshes.new("Point")
    data.from_pydata([PLACE], [], [])
    found = new("Scattered", data)
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    begin, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    sphere = tree.nodes.new("GeometryNodeMeshUVSphere")
    sphere.inputs["Radius"].default_value = 0.3
    on_points = tree.nodes.new("GeometryNodeInstanceOnPoints")
    tree.links.new(begin.outputs[0], on_points.inputs["Points"])
    tree.links.new(sphere.outputs["Mesh"], on_points.inputs["Instance"])
    tree.links.new(on_points.outputs[0], end.inputs[0])
    found.modifiers.new("Scatter", "NODES").node_group = tree
    return found


def metaball() -> bpy.types.Object:
    data = bpy.data.metaballs.new("Meta")
    element = data.elements.new()
    element.radius, data.resolution = 0.6, 0.1
    found = new("Meta", data)
    found.location = PLACE
    return found


def thick_curve() -> bpy.types.Object:
    data = bpy.data.curves.new("Thick", "CURVE")
    data.dimensions, data.bevel_depth, data.use_fill_caps = "3D", 0.3, True
    points = data.splines.new("POLY").points
    points.add(1)
    points[0].co, points[1].co = (0.6, 0, -0.4, 1), (0.6, 0, 0.4, 1)
    return new("Thick", data)


def text() -> bpy.types.Object:
    data = bpy.data.curves.new("Text", "FONT")
    data.body, data.extrude, data.size = "O", 0.3, 0.5
    found = new("Text", data)
    found.location = (0.5, -0.2, 0)
    return found


GIVES = [instanced_collection, nested_instances, geometry_nodes, metaball, thick_curve, text]


@pytest.mark.parametrize("make", GIVES)
def test_whatever_gives_triangles_is_an_obstacle(make):
    splash = made()
    plain = vertices(splash)
    splash.splash_obstacles.collection = collection(make())
    assert not splash.splash_stack.warnings
    assert "solid" in {verdict for _, verdict in splash.splash_obstacles.listed}
    assert len(vertices(splash)) != len(plain) or np.abs(vertices(splash) - plain).max() > 0.01
    if make not in (text, metaball):
        assert closest(splash) > 0.28


@pytest.mark.parametrize("matrix", [Matrix.Scale(2, 4), Matrix.Scale(-0.5, 4, (1, 0, 0))])
def test_a_scaled_splash_sees_its_obstacle_in_the_right_place(matrix):
    splash = made()
    splash.matrix_world = matrix
    bpy.context.view_layer.update()
    place = tuple(matrix @ Matrix.Translation(PLACE).translation)
    size = abs(matrix.determinant()) ** (1 / 3)
    before = closest(splash, place)
    splash.splash_obstacles.collection = collection(ball(0.3 * size, place))
    assert before < 0.2 * size
    assert 0.28 * size < closest(splash, place) < 0.36 * size


def open_ball(share: float) -> bpy.types.Object:
    """Return a ball without the faces above a height, as share of its diameter."""
    item = ball()
    import bmesh

    mesh = bmesh.new()
    mesh.from_mesh(item.data)
    gone = [f for f in mesh.faces if f.calc_center_median().z > 0.3 * (2 * share - 1)]
    bmesh.ops.delete(mesh, geom=gone, context="FACES")
    mesh.to_mesh(item.data)
    mesh.free()
    return item


def test_the_choice_of_solid_or_sheet_and_its_verdict():
    splash = made()
    bowl = open_ball(0.5)
    splash.splash_obstacles.collection = collection(bowl)
    assert dict(splash.splash_obstacles.listed)["Sphere"] == "thin sheet"
    assert "not closed" in splash.splash_stack.warnings
    bowl.splash_obstacle.kind = "SOLID"
    assert dict(splash.splash_obstacles.listed)["Sphere"] == "solid"
    assert not splash.splash_stack.warnings
    below = in_world(splash)
    inside = (np.linalg.norm(below - PLACE, axis=1) < 0.27) & (below[:, 2] < -0.02)
    assert not inside.any(), "nothing in the bowl"
    bowl.splash_obstacle.kind = "SHEET"
    assert dict(splash.splash_obstacles.listed)["Sphere"] == "thin sheet"
    assert not splash.splash_stack.warnings, "it was chosen"


def test_animated_and_overridden_obstacles(tmp_path):
    item = ball(0.3, (9, 9, 9))
    item.location = (9, 9, 9)
    item.keyframe_insert("location", frame=1)
    item.location = PLACE
    item.keyframe_insert("location", frame=5)
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {item}, fake_user=True)
    bpy.data.objects.remove(item)
    splash = made()
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.objects = ["Sphere"]
    home = collection()
    home.objects.link(wanted.objects[0])
    override = wanted.objects[0].override_create(remap_local_usages=True)
    if override.name not in home.objects:
        home.objects.link(override)
    bpy.context.scene.frame_set(5)
    splash.splash_obstacles.collection = home
    assert closest(splash) > 0.29
