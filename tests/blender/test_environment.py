# SPDX-License-Identifier: GPL-3.0-or-later
"""What is around a splash: other scenes and windows, languages, many objects, what goes away."""

import shutil
from pathlib import Path

import bpy
import numpy as np
import pytest

import liquid_splash_addon
from liquid_splash_addon.blender.jobs import scheduler, staleness, work_queue
from tests.blender.drawing_panels import draw_all
from tests.blender.modelling import crossing, generate_layers
from tests.blender.sketching import add_sketch, fan, generate, splashes, vertices
from tests.blender.test_window import run_in_a_window, screen  # noqa: F401
from tests.blender.test_work_queue import Gate, gate, run_queue, windowed  # noqa: F401

pytestmark = pytest.mark.once

SCRIPT = Path(__file__).with_name("environment_window.py")

RUSSIAN, GERMAN = "ru_RU", "de_DE"


def made_of_everything() -> list[tuple[str, int]]:
    """Make a bit of everything, draw all panels, and return the objects with their vertices."""
    add_sketch(fan())
    generate()
    assert bpy.ops.splash.refinement_preset(preset="STORM") == {"FINISHED"}
    assert bpy.ops.splash.drop_points() == {"FINISHED"}
    assert bpy.ops.splash.ballistic_preview() == {"FINISHED"}
    assert bpy.ops.splash.two_pose_mesh() == {"FINISHED"}
    assert bpy.ops.splash.preset_sketch() == {"FINISHED"}
    generate_layers(crossing())
    bpy.context.view_layer.update()
    draw_all()
    graph = bpy.context.evaluated_depsgraph_get()
    found = []
    for item in bpy.context.scene.objects:
        shown = item.evaluated_get(graph)
        count = len(shown.data.vertices) if item.type == "MESH" and shown.type == "MESH" else 0
        found.append((item.name, count))
    return sorted(found)


@pytest.mark.parametrize("language", [RUSSIAN, GERMAN])
def test_in_another_language_the_same_is_made(thick_drafts, language):
    """Blender then gives nodes, layers and new data names in that language."""
    view = bpy.context.preferences.view
    if language not in bpy.app.translations.locales:
        pytest.skip("this Blender has no translations")
    english = made_of_everything()
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.context.scene.splash.settings.resolution = "64"
    view.language = language
    view.use_translate_interface = view.use_translate_tooltips = True
    view.use_translate_new_dataname = True
    try:
        assert made_of_everything() == english
    finally:
        view.language = "en_US"


def test_a_splash_of_each_scene(tubes):
    first = bpy.context.scene
    add_sketch(fan())
    one = generate()
    second = bpy.data.scenes.new("Second")
    bpy.context.window.scene = second
    add_sketch(fan(size=2.0))
    other = generate()
    assert (list(splashes()), one in [*second.objects]) == ([other], False)
    before = vertices(one)
    assert bpy.ops.splash.refinement_add(kind="CLEANUP") == {"FINISHED"}
    assert bpy.ops.splash.regenerate(seed=3, variation=1.0) == {"FINISHED"}
    np.testing.assert_array_equal(vertices(one), before)
    bpy.context.window.scene = first
    bpy.context.view_layer.objects.active = one
    kept = vertices(other)
    assert bpy.ops.splash.regenerate(seed=5, variation=1.0) == {"FINISHED"}
    np.testing.assert_array_equal(vertices(other), kept)
    assert len(vertices(one)) != len(before) or (vertices(one) != before).any()


def test_a_sketch_that_only_another_scene_has(tubes):
    """It still makes the splash, on its place."""
    sketch = add_sketch(fan())
    sketch.location = (3, 0, 0)
    splash = generate()
    second = bpy.data.scenes.new("Second")
    second.collection.objects.link(splash)
    bpy.context.window.scene = second
    bpy.context.view_layer.objects.active = splash
    place = splash.matrix_world.copy()
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    assert splash.matrix_world == place


def test_disabled_while_a_change_is_computed(tubes, windowed, gate):  # noqa: F811
    """Nothing is written any more; enabled again, the change is not lost."""
    add_sketch(fan())
    bpy.context.scene.splash.settings.resolution = "64"
    splash = generate()
    name, before = splash.name, vertices(splash)
    bpy.ops.splash.refinement_add(kind="DROPLETS")
    work_queue.tick()
    assert gate.entered.wait(60)
    gate.opened.set()
    liquid_splash_addon.unregister()
    try:
        assert work_queue.running() is None
        assert len(bpy.data.objects[name].data.vertices) == len(before)
    finally:
        liquid_splash_addon.register()
    again = bpy.data.objects[name]
    assert [item.kind for item in again.splash_stack.items] == ["DROPLETS"]
    scheduler.go_on()
    run_queue()
    assert not again.splash_stack.pending
    assert len(vertices(again)) != len(before)


def copies(splash: bpy.types.Object, count: int) -> list[bpy.types.Object]:
    """Return copies of a splash, each with a mesh of its own."""
    found = []
    for _ in range(count):
        copy = splash.copy()
        copy.data = splash.data.copy()
        bpy.context.scene.collection.objects.link(copy)
        found.append(copy)
    bpy.context.view_layer.update()
    return found


def test_many_splashes_are_looked_at_in_slices(tubes, windowed, monkeypatch):  # noqa: F811
    """After undo all are looked at: Blender has its turn in between."""
    add_sketch(fan())
    items = [generate(), *copies(generate(), 6)]
    monkeypatch.setattr(work_queue, "SLICE", 0.0)
    scheduler.after_undo(bpy.context.scene)
    waiting = len(items)
    while waiting:
        assert work_queue.tick() is not None or waiting == 1
        assert len(work_queue._lanes[False].waiting) == waiting - 1, "one at a time"
        waiting -= 1
    assert work_queue.tick() is None


def test_many_splashes_are_compared_in_slices(tubes, monkeypatch):
    add_sketch(fan())
    copies(generate(), 6)
    monkeypatch.setattr(work_queue, "SLICE", 0.0)
    staleness.look_at_all(bpy.context.scene)
    waiting = len(staleness._waiting)
    assert waiting == 7
    for left in range(waiting - 1, -1, -1):
        assert staleness.look_later() == (staleness.GO_ON if left else None)
        assert len(staleness._waiting) == left
    staleness.forget()


@pytest.mark.slow
@pytest.mark.skipif(
    not (bpy.app.binary_path and shutil.which("Xvfb")), reason="needs a Blender program and Xvfb"
)
def test_what_goes_away_in_the_middle_of_a_run(screen):  # noqa: F811
    printed = run_in_a_window(screen, SCRIPT)
    assert "window: works" in printed and "Traceback" not in printed, printed
