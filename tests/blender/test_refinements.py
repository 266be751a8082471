# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of refinements: live, never destructive, kept in the file."""

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.data import stored_liquid
from liquid_splash_addon.blender.data.refinements import steps_of
from liquid_splash_addon.blender.jobs import refine, scheduler
from liquid_splash_addon.core.refinement.settings import (
    CleanupSettings,
    DropletSettings,
    RuptureSettings,
    SheetSettings,
    WaveSettings,
)
from tests.blender.sketching import add_sketch, fan, generate, vertices

pytestmark = pytest.mark.usefixtures("tubes")


@pytest.fixture
def splash() -> bpy.types.Object:
    """A splash without refinements."""
    add_sketch(fan())
    return generate()


def add(kind: str) -> object:
    """Add a refinement to the active splash and return its list entry."""
    assert bpy.ops.splash.refinement_add(kind=kind) == {"FINISHED"}
    stack = bpy.context.active_object.splash_stack
    return stack.items[stack.active]


@pytest.mark.parametrize("kind", ["DROPLETS", "RUPTURES", "SHEETS", "WAVES"])
def test_a_refinement_changes_the_mesh_and_an_eye_switches_it_off(splash, kind):
    plain, fields = vertices(splash), stored_liquid.read(splash.data)[0]
    item = add(kind)
    refined = vertices(splash)
    assert refined.shape != plain.shape or np.abs(refined - plain).max() > 1e-4
    item.show = False
    np.testing.assert_array_equal(vertices(splash), plain)
    item.show = True
    np.testing.assert_array_equal(vertices(splash), refined)
    assert stored_liquid.read(splash.data)[0] == fields, "the generator's output stays"


def test_sliders_are_live_and_reversible(splash):
    item = add("WAVES")
    first = vertices(splash)
    item.waves.amplitude = 0.002
    assert np.abs(vertices(splash) - first).max() > 1e-5
    item.waves.amplitude = WaveSettings().amplitude
    np.testing.assert_array_equal(vertices(splash), first)


def test_settings_reach_core_as_they_were_given(splash):
    add("DROPLETS").droplets.size = 2.0
    add("RUPTURES")
    add("CLEANUP").show = False
    assert steps_of(splash) == [DropletSettings(size=2.0), RuptureSettings()]
    assert splash.splash_stack.items[2].settings == CleanupSettings()


def test_order_matters_and_can_be_changed(splash):
    add("DROPLETS").droplets.amount = 0.02
    add("RUPTURES").ruptures.amount = 0.1
    first = vertices(splash)
    assert bpy.ops.splash.refinement_move(direction="UP") == {"FINISHED"}
    assert [item.kind for item in splash.splash_stack.items] == ["RUPTURES", "DROPLETS"]
    assert vertices(splash).shape != first.shape
    assert bpy.ops.splash.refinement_move(direction="UP") == {"FINISHED"}, "at the top: no change"
    assert bpy.ops.splash.refinement_move(direction="DOWN") == {"FINISHED"}
    np.testing.assert_array_equal(vertices(splash), first)


def test_removing_the_last_one_gives_the_plain_splash(splash):
    plain = vertices(splash)
    add("DROPLETS")
    assert bpy.ops.splash.refinement_remove() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(splash), plain)
    assert not bpy.ops.splash.refinement_remove.poll()
    assert not bpy.ops.splash.refinement_apply.poll()


def test_names_tell_refinements_apart(splash):
    names = [add("WAVES").name, add("WAVES").name, add("DROPLETS").name]
    assert names == ["Waves", "Waves.001", "Droplets"]


def test_apply_keeps_the_mesh_and_empties_the_list(splash):
    add("DROPLETS")
    refined = vertices(splash)
    assert bpy.ops.splash.refinement_apply() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(splash), refined)
    assert len(splash.splash_stack.items) == 0
    assert bpy.ops.splash.regenerate(resolution="64") == {"FINISHED"}
    assert vertices(splash).shape != refined.shape


def test_regenerate_refines_again(splash):
    item = add("DROPLETS")
    item.droplets.amount = 0.02
    refined = vertices(splash)
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(splash), refined)


def test_steps_follow_the_seed_that_the_splash_was_made_with(splash):
    add("DROPLETS").droplets.amount = 0.02
    plain = vertices(splash)
    settings = splash.splash.settings
    settings.seed = 3
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(splash), plain, "without variation all are alike")
    settings.variation = 1.0
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    third = vertices(splash)
    settings.seed = 4  # asks for another splash, which is not made yet
    item = splash.splash_stack.items[0]
    item.droplets.amount = 0.01
    assert vertices(splash).shape != third.shape
    item.droplets.amount = 0.02
    np.testing.assert_array_equal(vertices(splash), third)


def test_a_preset_replaces_the_list(splash):
    add("CLEANUP")
    assert bpy.ops.splash.refinement_preset(preset="FRESH") == {"FINISHED"}
    assert steps_of(splash) == [DropletSettings(), SheetSettings(), WaveSettings()]


def test_a_saved_file_refines_without_generating(splash, tmp_path, monkeypatch):
    add("DROPLETS")
    refined, name = vertices(splash), splash.name
    path = str(tmp_path / "splash.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    refine.refiner = None
    bpy.ops.wm.open_mainfile(filepath=path)
    from liquid_splash_addon.blender.jobs import loaded_generator

    def forbidden(*_):
        raise AssertionError("the generator was asked")

    monkeypatch.setattr(loaded_generator, "get", forbidden)
    again = bpy.data.objects[name]
    again.splash_stack.items[0].show = False
    assert vertices(again).shape != refined.shape
    again.splash_stack.items[0].show = True
    np.testing.assert_array_equal(vertices(again), refined)


def test_velocity_is_carried_along(splash):
    fastest = np.linalg.norm(vertices(splash, "velocity"), axis=1).max()
    add("DROPLETS")
    add("WAVES")
    speed = np.linalg.norm(vertices(splash, "velocity"), axis=1)
    assert 0 < speed.max() < 2 * fastest


def test_lost_fields_are_reported_and_nothing_is_lost(splash):
    plain = vertices(splash)
    splash.data.splash_liquid.content = b""
    with pytest.raises(RuntimeError, match="generate it again"):
        bpy.ops.splash.refinement_add(kind="WAVES")
    np.testing.assert_array_equal(vertices(splash), plain)


def test_in_edit_mode_the_list_waits(splash):
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Object Mode"):
        bpy.ops.splash.refinement_add(kind="WAVES")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(splash.splash_stack.items) == 0


def test_more_drops_than_particles_are_reported(splash):
    item = add("DROPLETS")
    item.droplets.particles = 300
    item.droplets.amount = 1.0
    assert "Most Particles" in splash.splash_stack.warnings
    assert len(splash.data.polygons) > 0


def test_undo_of_a_slider_whose_result_came_after_the_step(splash):
    """Blender keeps a mesh that two steps show alike, whatever was written into it since."""
    waves = add("WAVES").waves
    bpy.ops.splash.drop_points()
    name, before = splash.name, vertices(splash)
    for number in range(3):
        bpy.ops.ed.undo_push(message=str(number))
    with scheduler.held():  # as where the queue has yet to make it
        waves.amplitude = 0.002
        bpy.ops.ed.undo_push(message="Slider")
    after = vertices(splash)
    bpy.context.view_layer.update()
    for undo, wanted in ((bpy.ops.ed.undo, before), (bpy.ops.ed.redo, after)):
        undo()
        np.testing.assert_array_equal(vertices(bpy.data.objects[name]), wanted)
