# SPDX-License-Identifier: GPL-3.0-or-later
"""Preset sketches in Blender: real Grease Pencil objects, and controls in the redo panel."""

from dataclasses import fields
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.scene.grease_pencil import drawn_strokes, read_drawings
from liquid_splash_addon.blender.ui.panels import SPLASH_PT_main
from liquid_splash_addon.blender.ui.sketch_presets import (
    SPLASH_MT_preset_sketches,
    SPLASH_OT_preset_sketch,
    property_name,
)
from liquid_splash_addon.core.sketch.presets import PRESETS
from tests.blender.sketching import add_sketch, fan, generate


class Recorder:
    """Stands in for a layout and keeps the properties, operators and menus it was given."""

    def __init__(self) -> None:
        self.__dict__["shown"] = []

    def __setattr__(self, name: str, value: object) -> None:
        """Keep any setting of a layout or of an operator's button."""
        self.shown.append((name, value, None))

    def __getattr__(self, name: str) -> object:
        def call(*args: object, **options: object) -> "Recorder":
            self.shown.append((name, args[-1] if args else None, options.get("text")))
            return self

        return call

    def names(self, kind: str) -> list[object]:
        """Return what was shown by the layout's method ``kind``."""
        return [name for method, name, _ in self.shown if method == kind]


def add(preset: str, **controls: object) -> bpy.types.Object:
    """Run the menu's operator and return the sketch."""
    assert bpy.ops.splash.preset_sketch(preset=preset, **controls) == {"FINISHED"}
    return bpy.context.active_object


def redo_panel(preset: str) -> list[object]:
    """Return the names of the properties that the redo panel shows for a preset."""
    layout = Recorder()
    operator = SimpleNamespace(
        layout=layout, preset=preset, property_of=lambda name: property_name(preset, name)
    )
    SPLASH_OT_preset_sketch.draw(operator, bpy.context)
    return layout.names("prop")


@pytest.mark.parametrize("name", PRESETS)
def test_the_sketch_is_as_core_drew_it(name):
    sketch = add(name)
    layers = PRESETS[name]().layers()
    assert [layer.name for layer in sketch.data.layers] == list(layers)
    for layer, drawings in zip(sketch.data.layers, layers.values(), strict=True):
        strokes = drawn_strokes(layer)
        assert len(strokes) == len(drawings)
        for stroke, drawing in zip(strokes, drawings, strict=True):
            np.testing.assert_allclose(stroke.points, drawing.points, atol=1e-5)
            np.testing.assert_allclose(stroke.times, drawing.times, atol=1e-5)
    read, warnings = read_drawings(sketch)
    assert warnings == [] and len(read) == sum(map(len, layers.values()))
    assert all(drawing.is_timed for drawing in read)


def test_it_stands_at_the_cursor_selected_and_in_object_mode():
    bpy.context.scene.cursor.location = (1, 2, 3)
    before = add_sketch(fan())
    before.select_set(True)
    bpy.ops.object.mode_set(mode="PAINT_GREASE_PENCIL")
    sketch = add("HEART")
    assert sketch != before and sketch.type == "GREASEPENCIL"
    assert tuple(sketch.location) == (1, 2, 3)
    assert sketch.mode == before.mode == "OBJECT"
    assert bpy.context.selected_objects == [sketch]
    assert sketch.name == sketch.data.name == "Heart Sketch"
    assert sketch.hide_render and sketch.show_in_front, "like any other sketch"


def test_controls_reach_core():
    sketch = add("CROWN", crown_points=4, crown_height=1.5, asymmetry=0.0)
    drawings, _ = read_drawings(sketch)
    assert len(drawings) == 8
    assert max(d.points[:, 2].max() for d in drawings) == pytest.approx(1.5)
    sketch = add("BUTTERFLY", butterfly_wings="TWO")
    assert [layer.name for layer in sketch.data.layers] == ["Left Wings", "Right Wings"]
    first, second = (read_drawings(add("SHEET", seed=seed))[0][0].points for seed in (0, 1))
    assert np.abs(first - second).max() > 0.01


@pytest.mark.parametrize("name", PRESETS)
def test_the_redo_panel_shows_the_controls_of_the_chosen_preset_only(name):
    shown = redo_panel(name)
    assert shown[0] == "preset" and shown[-2:] == ["asymmetry", "seed"]
    assert all(str(prop).startswith(name.lower()) for prop in shown[1:-2])
    assert len(shown) == len(set(shown)) == 1 + len(fields(PRESETS[name]))
    known = bpy.ops.splash.preset_sketch.get_rna_type().properties
    for item in fields(PRESETS[name]):
        prop = known[property_name(name, item.name)]
        assert prop.name == item.metadata["label"] and prop.description
        assert prop.is_skip_save, "the menu adds a preset as it is"
        if "low" in item.metadata:
            limits = (prop.hard_min, prop.hard_max, prop.default)
            asked = (item.metadata["low"], item.metadata["high"], item.default)
            assert limits == pytest.approx(asked)


def test_undo_takes_the_sketch_away_and_redo_brings_it_back():
    add_sketch(fan())
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.splash.preset_sketch("EXEC_DEFAULT", True, preset="LETTER_S")
    strokes = len(read_drawings(bpy.data.objects["Letter S Sketch"])[0])
    assert strokes > 1
    bpy.ops.ed.undo()
    assert [item.name for item in bpy.context.scene.objects] == ["Splash Sketch"]
    bpy.ops.ed.redo()
    assert len(read_drawings(bpy.data.objects["Letter S Sketch"])[0]) == strokes


def test_edit_mode_has_to_be_left_first():
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Leave Edit Mode first"):
        add("CROWN")
    bpy.ops.object.mode_set(mode="OBJECT")


def test_a_splash_can_be_made_of_it_at_once(tubes):
    sketch = add("BUTTERFLY")
    splash = generate()
    assert splash.splash.sketch == sketch and len(splash.data.polygons) > 1000
    assert splash.splash.warnings == ""


def test_the_menu_is_in_the_panel_and_lists_the_presets():
    panel = Recorder()
    SPLASH_PT_main.draw(SimpleNamespace(layout=panel), bpy.context)
    assert "SPLASH_MT_preset_sketches" in panel.names("menu")
    menu = Recorder()
    SPLASH_MT_preset_sketches.draw(SimpleNamespace(layout=menu), bpy.context)
    presets = ("operator", SPLASH_OT_preset_sketch.bl_idname)  # others may add entries of their own
    labels = [text for *shown, text in menu.shown if tuple(shown) == presets]
    assert labels == [preset.label for preset in PRESETS.values()]
    assert menu.names("preset") == list(PRESETS)
    for name, preset in PRESETS.items():
        about = SPLASH_OT_preset_sketch.description(bpy.context, SimpleNamespace(preset=name))
        assert about.startswith(preset.about)


def test_a_preset_is_active_in_the_scene_that_blender_starts_with() -> None:
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    assert bpy.ops.splash.preset_sketch(preset="CROWN") == {"FINISHED"}
    assert bpy.context.view_layer.objects.active == bpy.data.objects["Crown Sketch"]
    assert bpy.ops.splash.generate.poll()
