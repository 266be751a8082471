# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist adds to a splash survives that it is made anew; copies share nothing."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from liquid_splash_addon.blender.scene.sketch import add_strokes
from tests.blender.sketching import add_sketch, fan, generate, in_world, line, vertices
from tests.blender.test_places import activate, regenerate

pytestmark = pytest.mark.usefixtures("tubes")


def table(attribute, name: str, width: int) -> np.ndarray:
    values = np.empty((len(attribute.data), width), dtype=np.float32)
    attribute.data.foreach_get(name, values.ravel())
    return values


def decorated() -> bpy.types.Object:
    """Return a splash with one of everything that artists add, each a function of place."""
    add_sketch(fan())
    splash = generate()
    data, x = splash.data, vertices(splash)[:, 0]
    uv = data.uv_layers.new(name="Map")
    corner = np.array([loop.vertex_index for loop in data.loops])
    uv.data.foreach_set("uv", vertices(splash)[corner][:, :2].ravel())
    data.uv_layers.new(name="Other")
    data.uv_layers.active = data.uv_layers["Other"]
    data.attributes.new("heat", "FLOAT", "POINT").data.foreach_set("value", x)
    data.attributes.new("right", "BOOLEAN", "POINT").data.foreach_set("value", x > 0.5)
    colour = data.color_attributes.new("tint", "FLOAT_COLOR", "POINT")
    colour.data.foreach_set("color", np.repeat(x.clip(0, 1), 4))
    splash.vertex_groups.new(name="Tip").add(np.flatnonzero(x > 0.5).tolist(), 0.75, "REPLACE")
    data.materials.append(bpy.data.materials.new("Second"))
    second = [int(vertices(splash)[list(p.vertices)][:, 0].mean() > 0.5) for p in data.polygons]
    data.polygons.foreach_set("material_index", second)
    return splash


def check(splash: bpy.types.Object, most: float = 0.98) -> None:
    """Check that all of it is still that function of place, on ``most`` of the surface."""
    data, points = splash.data, vertices(splash)
    x = points[:, 0]
    corner = np.array([loop.vertex_index for loop in data.loops])
    uv = table(data.uv_layers["Map"], "uv", 2)
    assert np.quantile(np.abs(uv - points[corner][:, :2]), most) < 0.02
    assert data.uv_layers.active.name == "Other"
    heat = table(data.attributes["heat"], "value", 1)[:, 0]
    assert np.quantile(np.abs(heat - x), most) < 0.02
    tint = table(data.attributes["tint"], "color", 4)[:, 0]
    assert np.quantile(np.abs(tint - x.clip(0, 1)), most) < 0.02
    clear = np.abs(x - 0.5) > 0.03
    right = table(data.attributes["right"], "value", 1)[:, 0] > 0.5
    assert (right == (x > 0.5))[clear].mean() > most
    tip = np.array([any(g.weight > 0.7 for g in v.groups) for v in data.vertices])
    assert [group.name for group in splash.vertex_groups] == ["Tip"]
    assert (tip == (x > 0.5))[clear].mean() > most
    faces = np.array([p.material_index for p in data.polygons])
    middles = np.array([points[list(p.vertices)][:, 0].mean() for p in data.polygons])
    clear = np.abs(middles - 0.5) > 0.03
    assert (faces == (middles > 0.5))[clear].mean() > most
    assert [m.name for m in data.materials if m][1] == "Second"


@pytest.mark.parametrize("way", ["regenerate", "refine", "new stroke", "moved"])
def test_what_was_added_is_carried_over(way: str):
    splash = decorated()
    activate(splash)
    if way == "refine":
        assert bpy.ops.splash.refinement_add(kind="WAVES") == {"FINISHED"}
    else:
        if way == "new stroke":
            add_strokes(splash.splash.sketch, [line((0.2, -0.2, 0.1), (0.9, 0.3, 0.1))])
        elif way == "moved":
            splash.splash.sketch.matrix_world = Matrix.Translation((4, 5, 6))
        regenerate(splash)
    check(splash, 0.75 if way == "new stroke" else 0.98)
    assert "could not be carried" not in splash.splash.warnings


def test_an_attribute_that_cannot_be_carried_is_named():
    splash = decorated()
    splash.data.attributes.new("label", "STRING", "FACE")
    regenerate(splash)
    assert "'label' could not be carried over" in splash.splash.warnings
    check(splash)


def test_the_rest_of_the_object_stays():
    splash = decorated()
    splash.modifiers.new("Smooth", "SMOOTH")
    splash.constraints.new("LIMIT_LOCATION")
    splash["note"] = 7
    splash.hide_render, splash.pass_index = True, 3
    home = bpy.data.collections.new("Home")
    bpy.context.scene.collection.children.link(home)
    home.objects.link(splash)
    regenerate(splash)
    assert [m.name for m in splash.modifiers] == ["Smooth"] and len(splash.constraints) == 1
    assert splash["note"] == 7 and splash.hide_render and splash.pass_index == 3
    assert home in [*splash.users_collection]


def test_a_linked_duplicate_keeps_its_mesh_until_it_is_made_anew():
    add_sketch(fan())
    splash = generate()
    before = vertices(splash)
    copy = splash.copy()
    bpy.context.scene.collection.objects.link(copy)
    copy.location.x += 3
    add_strokes(splash.splash.sketch, [line((0.2, -0.2, 0.1), (0.9, 0.3, 0.1))])
    regenerate(splash)
    assert copy.data != splash.data and len(vertices(splash)) != len(before)
    np.testing.assert_array_equal(vertices(copy), before)
    regenerate(copy)
    np.testing.assert_array_equal(vertices(copy), vertices(splash))
    np.testing.assert_allclose(in_world(copy), in_world(splash) + (3, 0, 0), atol=1e-5)


def library_of(splash: bpy.types.Object, tmp_path) -> str:
    path = str(tmp_path / "splash.blend")
    bpy.data.libraries.write(path, {splash}, fake_user=True)
    return path


def opened(path: str, link: bool) -> bpy.types.Object:
    """Read the splash alone into a new file."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    with bpy.data.libraries.load(path, link=link) as (_, wanted):
        wanted.objects = ["Splash"]
    (splash,) = wanted.objects
    bpy.context.scene.collection.objects.link(splash)
    bpy.context.view_layer.update()
    return splash


def test_an_appended_splash_brings_its_sketch_and_is_made_anew_in_place(tmp_path):
    add_sketch(fan(), Matrix.Translation((3, 1, 2)))
    made = generate()
    expected, path = in_world(made), library_of(made, tmp_path)
    splash = opened(path, link=False)
    assert splash.splash.sketch is not None and not splash.splash.sketch.users_scene
    regenerate(splash)
    np.testing.assert_allclose(in_world(splash), expected, atol=1e-5)


def test_a_linked_splash_says_what_to_do_and_an_override_too(tmp_path):
    add_sketch(fan())
    path = library_of(generate(), tmp_path)
    splash = opened(path, link=True)
    activate(splash)
    before = vertices(splash)
    with pytest.raises(RuntimeError, match="linked from another file: make it local first"):
        bpy.ops.splash.regenerate()
    override = splash.override_create(remap_local_usages=True)
    if override.name not in bpy.context.scene.objects:
        bpy.context.scene.collection.objects.link(override)
    bpy.context.view_layer.update()
    activate(override)
    with pytest.raises(RuntimeError, match="linked from another file: make it local first"):
        bpy.ops.splash.regenerate()
    np.testing.assert_array_equal(vertices(override), before)
