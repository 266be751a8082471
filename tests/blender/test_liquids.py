# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquids to choose from: materials, physics, and what shaders know of a mesh."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.data.look import METRES
from liquid_splash_addon.blender.jobs import staleness
from liquid_splash_addon.blender.scene.liquid_materials import LOOKS, liquid_of, material_of
from liquid_splash_addon.blender.scene.material import water_material
from liquid_splash_addon.blender.ui.look_panel import SPLASH_PT_look
from liquid_splash_addon.core.liquids import LIQUIDS
from liquid_splash_addon.core.refinement.shader_attributes import NAMES
from tests.blender.drawing_panels import drawn
from tests.blender.sketching import SIZE, add_sketch, fan, generate, vertices
from tests.blender.slab import shot

pytestmark = pytest.mark.usefixtures("tubes")
PLAIN = set(NAMES) - {"tint", "tinted"}


@pytest.fixture
def splash() -> bpy.types.Object:
    """A splash of water without refinements."""
    add_sketch(fan())
    return generate()


def become(liquid: str) -> None:
    assert bpy.ops.splash.liquid(liquid=liquid) == {"FINISHED"}


def values(item: bpy.types.Object, name: str, width: int = 1) -> np.ndarray:
    """Return an attribute of a mesh's points, ``(n, width)``."""
    found = np.empty((len(item.data.vertices), width))
    field = "color" if width == 4 else "value"
    item.data.attributes[name].data.foreach_get(field, found.ravel())
    return found


def names(item: bpy.types.Object) -> set[str]:
    return {a.name for a in item.data.attributes} & set(NAMES)


def test_water_is_what_it_was(splash):
    assert splash.data.materials[0] == water_material() and not names(splash)
    assert splash.splash.settings.liquid == "WATER"


@pytest.mark.parametrize("liquid", LIQUIDS)
def test_a_liquid_is_chosen_by_one_menu(splash, liquid):
    become(liquid)
    assert liquid_of(splash.data.materials[0]) == liquid and len(splash.data.materials) == 1
    assert splash.splash.settings.liquid == liquid
    assert names(splash) == (set() if liquid == "WATER" else PLAIN)
    assert LIQUIDS[liquid].label in drawn(SPLASH_PT_look)


def test_asking_again_finds_the_shared_material_also_renamed(splash):
    become("WINE")
    first = splash.data.materials[0]
    first.name = "Chianti"
    become("MILK")
    become("WINE")
    assert splash.data.materials[0] == first
    assert material_of("MILK") == material_of("MILK") != first


def test_a_linked_material_is_not_taken_for_our_own(splash, tmp_path):
    wine = material_of("WINE")
    bpy.data.libraries.write(str(tmp_path / "wine.blend"), {wine}, fake_user=True)
    bpy.data.materials.remove(wine)
    with bpy.data.libraries.load(str(tmp_path / "wine.blend"), link=True) as (there, here):
        here.materials = there.materials
    linked = here.materials[0]
    become("WINE")
    assert splash.data.materials[0] != linked and splash.data.materials[0].library is None
    assert liquid_of(linked) == "WINE", "an object that has it is of wine all the same"


def test_material_and_physics_can_be_changed_alone(splash):
    bpy.ops.splash.refinement_add(kind="WAVES")
    before = vertices(splash)
    splash.data.materials[0] = material_of("HONEY")
    bpy.ops.splash.refinement_update()
    np.testing.assert_array_equal(vertices(splash), before)
    splash.splash.settings.liquid = "HONEY"
    assert np.abs(vertices(splash) - before).max() > 1e-5, "its refinements follow at once"
    assert staleness.is_out_of_date(splash), "and Breakup, once it is made again"
    splash.splash.settings.liquid = "WATER"
    np.testing.assert_array_equal(vertices(splash), before)
    assert not staleness.is_out_of_date(splash)


def test_a_liquid_chosen_before_is_for_new_splashes():
    become("CHOCOLATE")
    add_sketch(fan())
    splash = generate()
    assert liquid_of(splash.data.materials[0]) == "CHOCOLATE" and names(splash) == PLAIN
    bpy.context.scene.splash.settings.liquid = "WATER"


def test_attributes_are_at_real_size_and_survive_what_is_done_to_the_mesh(splash):
    splash.splash_look.attributes = True
    assert names(splash) == PLAIN
    assert splash[METRES] == pytest.approx(SIZE / np.ptp(vertices(splash), axis=0).max(), rel=0.2)
    thick = np.median(values(splash, "thickness"))
    assert 0.005 < thick < 0.03, "tubes of 1.7 cells of 6.3 mm"
    assert values(splash, "stroke").min() == 0 and values(splash, "stroke").max() == 5
    for change in (
        lambda: bpy.ops.splash.refinement_add(kind="DROPLETS"),
        lambda: bpy.ops.splash.refinement_preset(preset="FRESH"),
        bpy.ops.splash.refinement_apply,
        bpy.ops.splash.regenerate,
    ):
        change()
        assert names(splash) == PLAIN and not splash.splash_stack.warnings
        assert np.isfinite(values(splash, "age")).all()
    splash.splash_look.attributes = False
    assert not names(splash)


def test_an_artists_attribute_of_the_same_name_stays_his(splash):
    mine = splash.data.attributes.new("age", "FLOAT", "POINT")
    mine.data.foreach_set("value", np.full(len(splash.data.vertices), 7.0, dtype=np.float32))
    splash.splash_look.attributes = True
    assert (values(splash, "age") == 7).all()
    bpy.ops.splash.regenerate()
    assert (values(splash, "age") == 7).all() and names(splash) == PLAIN


def test_strokes_colour_the_liquid_by_material_and_layer(splash):
    sketch = splash.splash.sketch
    cocoa = bpy.data.materials.new("Cocoa")
    bpy.data.materials.create_gpencil_data(cocoa)
    cocoa.grease_pencil.color = (0.2, 0.05, 0.01, 1)
    sketch.data.materials.append(cocoa)
    drawing = sketch.data.layers[0].frames[0].drawing
    for number, stroke in enumerate(drawing.strokes):
        stroke.material_index = number % 2
    bpy.ops.splash.regenerate()
    assert not names(splash)
    splash.splash_look.stroke_colours = True
    stroke, tinted = values(splash, "stroke")[:, 0], values(splash, "tinted")[:, 0]
    own = [np.median(tinted[stroke == n]) for n in range(6)]
    np.testing.assert_allclose(own, [0, 1] * 3, atol=0.15)
    shown = values(splash, "tint", 4)[tinted > 0.1, :3]
    np.testing.assert_allclose(shown, [[0.2, 0.05, 0.01]] * len(shown), atol=1e-3)
    layer = sketch.data.layers[0]
    layer.tint_color, layer.tint_factor = (1, 0, 0), 1.0
    bpy.ops.splash.regenerate()
    np.testing.assert_allclose(values(splash, "tint", 4)[:, :3] * [1, 1, 1], [[1, 0, 0]] * len(
        splash.data.vertices), atol=0.01)  # fmt: skip


def test_a_model_has_attributes_and_a_liquid(splash):
    other = bpy.data.objects.new("Splash 2", splash.data.copy())
    bpy.data.objects.remove(other)
    assert bpy.ops.splash.combine() == {"FINISHED"}
    model = bpy.context.active_object
    bpy.context.view_layer.objects.active = model
    model.splash_model.settings.mirror_y = True
    become("PAINT")
    assert liquid_of(model.data.materials[0]) == "PAINT" and names(model) == PLAIN
    assert splash.splash.settings.liquid == "PAINT"
    assert values(model, "stroke").max() == 11, "copies' strokes count on"
    model.splash_model.use_sheets = model.splash_model.use_waves = True
    assert names(model) == PLAIN and not model.splash_model.warnings
    assert model[METRES] > 0


def test_drops_are_of_the_same_liquid(splash):
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    become("WINE")
    bpy.ops.splash.drop_points()
    drops = splash.splash_stack.points
    assert liquid_of(drops.data.materials[0]) == "WINE" and drops[METRES] > 0
    become("MILK")
    assert liquid_of(drops.data.materials[0]) == "MILK"
    bpy.context.view_layer.update()
    shown = drops.evaluated_get(bpy.context.evaluated_depsgraph_get()).evaluated_geometry()
    assert shown.pointcloud is None or liquid_of(shown.pointcloud.materials[0]) == "MILK"


@pytest.mark.skipif("usd_export" not in dir(bpy.ops.wm), reason="this Blender has no USD")
def test_attributes_reach_usd(splash, tmp_path):
    splash.splash_look.attributes = True
    path = tmp_path / "splash.usdc"
    bpy.ops.wm.usd_export(filepath=str(path), selected_objects_only=False)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(path))
    meshes = [m for m in bpy.data.meshes if len(m.vertices)]
    assert meshes and {a.name for a in meshes[0].attributes} >= PLAIN


@pytest.mark.parametrize("liquid", ["WINE", "HONEY"])
def test_cycles_absorbs_by_beers_law_in_metres(tmp_path, liquid):
    look = LOOKS[liquid]
    seen = shot(tmp_path, material_of(liquid), 2.0, 0.01)  # a unit of the world, 2 of the slab's
    # All of a white world is seen, but what reflects inside goes a longer way: a slab's series.
    left = np.array(look.colour) ** (0.01 / look.depth)
    mirror = ((look.ior - 1) / (look.ior + 1)) ** 2
    through = (1 - mirror) ** 2 * left / (1 - mirror * left)
    np.testing.assert_allclose(seen, mirror + through, rtol=0.05, atol=0.01)


@pytest.mark.slow
def test_eevee_absorbs_by_beers_law_in_metres(tmp_path):
    script = Path(__file__).with_name("slab.py")
    start = [sys.executable, str(script)]
    if not bpy.app.module:
        start = [bpy.app.binary_path, "--background", "--factory-startup", "--python", str(script)]
        start = ["xvfb-run", "-a", *start] if shutil.which("xvfb-run") else start
    command = [*start, "--", str(tmp_path), "WINE", "HONEY"]
    graphics = {**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=graphics)
    said = [line for line in done.stdout.splitlines() if line.startswith("seen:")]
    if not said:
        pytest.skip("EEVEE cannot render here")
    for name, seen in json.loads(said[0].removeprefix("seen:")).items():
        left = np.array(LOOKS[name].colour) ** (0.01 / LOOKS[name].depth)
        mirror = ((LOOKS[name].ior - 1) / (LOOKS[name].ior + 1)) ** 2
        np.testing.assert_allclose(seen, mirror + (1 - mirror) * left, rtol=0.08, atol=0.01)
