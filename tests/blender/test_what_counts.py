# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes that nobody sees, or that are locked, make no liquid, and it is said."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.scene.sketch import add_strokes
from tests.blender.sketching import add_sketch, fan, generate, line, vertices

pytestmark = pytest.mark.usefixtures("tubes")

EXTRA = line((-0.2, 0.6, 0.1), (0.4, 0.8, 0.2))


def expected() -> np.ndarray:
    """Return the splash of the fan alone."""
    add_sketch(fan())
    return vertices(generate())


def own_layer(sketch: bpy.types.Object):
    layer = sketch.data.layers.new("Extra")
    layer.frames.new(bpy.context.scene.frame_current)
    add_strokes(sketch, [EXTRA], layer)
    return layer


def hidden_layer(sketch: bpy.types.Object) -> None:
    own_layer(sketch).hide = True


def locked_layer(sketch: bpy.types.Object) -> None:
    own_layer(sketch).lock = True


def faded_layer(sketch: bpy.types.Object) -> None:
    own_layer(sketch).opacity = 0


def locked_group(sketch: bpy.types.Object) -> None:
    group = sketch.data.layer_groups.new("Group")
    sketch.data.layers.move_to_layer_group(own_layer(sketch), group)
    group.lock = True


def last_stroke(sketch: bpy.types.Object):
    add_strokes(sketch, [EXTRA])
    return sketch.data.layers[0].current_frame().drawing


def material(sketch: bpy.types.Object):
    """Give an extra stroke a material of its own."""
    new = bpy.data.materials.new("Own")
    bpy.data.materials.create_gpencil_data(new)
    sketch.data.materials.append(new)
    last_stroke(sketch).strokes[-1].material_index = 1
    return new.grease_pencil


def hidden_material(sketch: bpy.types.Object) -> None:
    material(sketch).hide = True


def fill(sketch: bpy.types.Object) -> None:
    style = material(sketch)
    if bpy.app.version < (5, 1, 0):
        style.show_stroke, style.show_fill = False, True
    else:  # the strokes' own
        drawing = sketch.data.layers[0].current_frame().drawing
        unseen = drawing.attributes.new("hide_stroke", "BOOLEAN", "CURVE")
        values = [False] * len(unseen.data)
        values[-1] = True
        unseen.data.foreach_set("value", values)


def clear_stroke(sketch: bpy.types.Object) -> None:
    for point in last_stroke(sketch).strokes[-1].points:
        point.opacity = 0


WAYS = {
    hidden_layer: "1 hidden layer",
    locked_layer: "1 locked layer",
    locked_group: "1 locked layer",
    faded_layer: "1 layer(s) of opacity 0",
    hidden_material: "1 stroke(s) of a hidden material",
    fill: "1 fill",
    clear_stroke: "1 stroke(s) of opacity 0",
}


@pytest.mark.parametrize("way", WAYS)
def test_it_does_not_count_and_is_said(way):
    before = expected()
    sketch = add_sketch(fan())
    way(sketch)
    generate()
    splash = bpy.context.active_object
    np.testing.assert_array_equal(vertices(splash), before)
    assert f"Left out {WAYS[way]}" in splash.splash.warnings


@pytest.mark.parametrize("way", [hidden_layer, locked_layer, hidden_material, fill])
def test_where_nothing_is_left_the_reason_is_the_message(way):
    sketch = add_sketch([])
    way(sketch)
    with pytest.raises(RuntimeError, match=r"No stroke is left .* Left out 1"):
        generate()
    assert not bpy.data.meshes


def test_select_strokes_counts_as_reading_does():
    tap = line((0.2, 0.2, 0.2), (0.2, 0.2, 0.2))
    sketch = add_sketch(fan()[:1])
    hidden_material(sketch)
    add_strokes(sketch, [tap])
    generate()
    assert bpy.ops.splash.select_strokes() == {"FINISHED"}
    strokes = sketch.data.layers[0].current_frame().drawing.strokes
    assert [stroke.select for stroke in strokes] == [False, False, True]


def test_modifiers_that_do_not_count_are_said_and_count_on_request():
    sketch = add_sketch(fan())
    sketch.modifiers.new("Offset", "GREASE_PENCIL_OFFSET").location = (0, 0, 2)
    splash = generate()
    assert "Modifiers do not count (Offset)" in splash.splash.warnings
    assert vertices(splash)[:, 2].max() < 1
    splash = generate(use_modifiers=True)
    assert not splash.splash.warnings and vertices(splash)[:, 2].min() > 1


def test_mirrored_strokes_count_when_evaluated():
    sketch = add_sketch(fan())
    sketch.modifiers.new("Mirror", "GREASE_PENCIL_MIRROR")
    splash = generate(use_modifiers=True)
    assert vertices(splash)[:, 0].min() < -0.8 and vertices(splash)[:, 0].max() > 0.8


def test_a_masked_layer_is_said():
    sketch = add_sketch(fan())
    own_layer(sketch)
    layer = sketch.data.layers[0]
    layer.use_masks = True
    bpy.context.view_layer.objects.active = sketch
    sketch.data.layers.active = layer
    assert bpy.ops.grease_pencil.layer_mask_add(name="Extra") == {"FINISHED"}
    assert f"Layer '{layer.name}' is masked" in generate().splash.warnings
