# SPDX-License-Identifier: GPL-3.0-or-later
"""How a sketch begins: where strokes lie, and what the viewport says to do next."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import pytest

from liquid_splash_addon.blender.scene.sketch import PLACEMENTS, add_strokes, is_sketch
from liquid_splash_addon.blender.ui import viewport_hint
from liquid_splash_addon.blender.ui.sketch_tool import SPLASH_MT_new_sketch, SPLASH_OT_draw_stroke
from liquid_splash_addon.blender.ui.viewport_hint import DRAW, FEW, MAKE, RESUME, hint_for
from tests.blender.drawing_panels import drawn
from tests.blender.sketching import add_sketch, fan, generate, line


@pytest.fixture(autouse=True)
def empty_scene():
    """Begin and end in Object Mode; begin without objects."""
    leave_modes()
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    yield
    leave_modes()


def leave_modes() -> None:
    """Enter Object Mode."""
    if bpy.context.active_object is not None and bpy.context.active_object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("name", PLACEMENTS)
def test_new_sketch_sets_where_strokes_lie(name):
    assert bpy.ops.splash.new_sketch(placement=name) == {"FINISHED"}
    tools = bpy.context.scene.tool_settings
    assert tools.gpencil_stroke_placement_view3d == PLACEMENTS[name].placement
    assert tools.gpencil_sculpt.lock_axis == PLACEMENTS[name].lock_axis
    assert bpy.context.active_object.mode == "PAINT_GREASE_PENCIL"
    assert is_sketch(bpy.context.active_object)


def test_the_menu_beside_the_button_shows_all_placements():
    said = drawn(SPLASH_MT_new_sketch)
    assert all(placement.label in said for placement in PLACEMENTS.values())


def test_the_tool_draws_on_the_active_sketch_else_on_a_new_one():
    sketch = add_sketch([])
    for expected in (sketch, None):
        if expected is None:
            leave_modes()
            bpy.context.view_layer.objects.active = None
        SPLASH_OT_draw_stroke.execute(SimpleNamespace(), bpy.context)
        active = bpy.context.active_object
        assert active.mode == "PAINT_GREASE_PENCIL" and is_sketch(active)
        assert (active == sketch) == (expected is not None)


def test_hints_lead_to_the_first_splash_and_end_there(tubes):
    assert hint_for(bpy.context) == "", "nobody asked for a splash"
    bpy.ops.splash.new_sketch()
    assert hint_for(bpy.context) == DRAW
    bpy.ops.object.mode_set(mode="OBJECT")
    assert hint_for(bpy.context) == RESUME
    sketch = bpy.context.active_object
    add_strokes(sketch, [line((0.3, 0, 0), (1, 0, 1))])
    assert hint_for(bpy.context) == FEW
    add_strokes(sketch, fan())
    assert hint_for(bpy.context) == MAKE
    generate()
    assert hint_for(bpy.context) == ""


def test_hints_can_be_switched_off(monkeypatch):
    bpy.ops.splash.new_sketch()
    monkeypatch.setattr(
        viewport_hint, "own_preferences", lambda _context: SimpleNamespace(show_hints=False)
    )
    assert hint_for(bpy.context) == ""


def test_other_peoples_grease_pencil_gets_no_hint():
    sketch = add_sketch(fan())
    sketch.data.materials.clear()
    assert not is_sketch(sketch) and hint_for(bpy.context) == ""
