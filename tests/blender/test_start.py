# SPDX-License-Identifier: GPL-3.0-or-later
"""What new splashes start with: chosen by the operator, the scene or the preferences."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.data import start
from liquid_splash_addon.blender.data.refinements import steps_of
from liquid_splash_addon.blender.ui.panels import SPLASH_PT_main
from liquid_splash_addon.core.refinement.presets import BARE, PRESETS
from tests.blender.drawing_panels import drawn
from tests.blender.modelling import crossing, the_model
from tests.blender.sketching import SIZE, add_sketch, fan, generate, splashes, vertices

pytestmark = pytest.mark.usefixtures("tubes")


def press(**given: object) -> bpy.types.Object:
    """Generate a draft, and return its splash."""
    assert bpy.ops.splash.generate(resolution="64", real_size=SIZE, **given) == {"FINISHED"}
    return splashes()[0]


def steps(name: str) -> list:
    """Return the refinements of a preset."""
    return list(PRESETS[name].steps)


def test_the_first_splash_has_films_drops_and_waves_without_being_told():
    sketch = add_sketch(fan())
    splash = press()
    assert steps_of(splash) == steps("FRESH")
    found = vertices(splash)
    assert splash.splash_stack.summary and not splash.splash_stack.pending
    bpy.data.objects.remove(splash)
    bpy.context.view_layer.objects.active = sketch
    bare = generate(speed_gain=bpy.context.scene.splash.settings.speed_gain)
    assert vertices(bare).shape != found.shape
    bpy.context.view_layer.objects.active = bare
    assert bpy.ops.splash.refinement_preset(preset="FRESH") == {"FINISHED"}
    np.testing.assert_array_equal(vertices(bare), found)


def test_a_scene_and_the_operator_choose():
    group = bpy.context.scene.splash
    assert group.start == "FRESH"
    group.start = "MILK"
    add_sketch(fan())
    assert steps_of(press()) == steps("MILK")
    add_sketch(fan(speed=1.0))
    press(start=BARE)
    assert group.start == "MILK"
    assert sorted(len(steps_of(item)) for item in splashes()) == [0, len(steps("MILK"))]


def test_a_splash_that_exists_keeps_its_list():
    sketch = add_sketch(fan())
    splash = press(start=BARE)
    bpy.context.view_layer.objects.active = sketch
    assert steps_of(press()) == [] and len(splashes()) == 1, "Generate makes the same one again"
    bpy.context.view_layer.objects.active = splash
    assert bpy.ops.splash.refinement_add(kind="WAVES") == {"FINISHED"}
    splash.splash_stack.items[0].waves.amplitude = 0.002
    for name in ("regenerate", "realign", "step_seed"):
        assert getattr(bpy.ops.splash, name)() == {"FINISHED"}
        (step,) = steps_of(splash)
        assert step.amplitude == 0.002


def test_scenes_without_a_choice_follow_the_preferences(monkeypatch):
    group = bpy.context.scene.splash
    preferences = SimpleNamespace(start="STORM")
    monkeypatch.setattr(start, "own_preferences", lambda _: preferences)
    assert group.start == "STORM"
    group.start = "FINGERS"
    preferences.start = "MILK"
    assert group.start == "FINGERS"
    assert bpy.data.scenes.new("Other").splash.start == "MILK"


def test_the_choice_is_in_the_file(tmp_path):
    bpy.context.scene.splash.start = BARE
    path = str(tmp_path / "choice.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.context.scene.splash.start = "FRESH"
    bpy.ops.wm.open_mainfile(filepath=path)
    assert bpy.context.scene.splash.start == BARE


def test_a_choice_that_is_not_known_is_none():
    bpy.context.scene.splash.chosen_start = "OF_A_LATER_VERSION"
    assert bpy.context.scene.splash.start == "FRESH"


def test_the_choice_stands_beside_the_button_until_there_is_a_splash():
    add_sketch(fan())
    assert "start" in drawn(SPLASH_PT_main).split()
    press(start=BARE)
    assert "start" not in drawn(SPLASH_PT_main).split()


def test_layers_start_with_it_too(thick_drafts):
    sketch = crossing()
    bpy.context.scene.splash.start = "MILK"
    bpy.context.view_layer.objects.active = sketch
    assert bpy.ops.splash.generate_layers() == {"FINISHED"}
    assert [steps_of(item) for item in splashes()] == [steps("MILK")] * 2
    assert len(the_model().data.polygons) > 1000
