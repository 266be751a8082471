# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes that nobody sees, or that are locked, make no liquid, and it is said."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.scene.sketch import add_strokes
from liquid_splash_addon.blender.scene.stroke_objects import read_object
from liquid_splash_addon.core.sketch.drawing import Drawing
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


def array(sketch: bpy.types.Object) -> None:
    modifier = sketch.modifiers.new("Array", "GREASE_PENCIL_ARRAY")
    modifier.count, modifier.use_relative_offset = 2, False
    modifier.use_constant_offset, modifier.constant_offset = True, (0, 0, 0.7)


def build(sketch: bpy.types.Object) -> None:
    """Half of every stroke is there by now."""
    modifier = sketch.modifiers.new("Build", "GREASE_PENCIL_BUILD")
    modifier.mode, modifier.transition = "CONCURRENT", "GROW"
    modifier.time_mode, modifier.percentage_factor = "PERCENTAGE", 0.5


def smooth(sketch: bpy.types.Object) -> None:
    modifier = sketch.modifiers.new("Smooth", "GREASE_PENCIL_SMOOTH")
    modifier.factor, modifier.step = 1.0, 40


def read_evaluated(modify) -> tuple[list, list]:
    """Return a fan, every other point off its line, without modifiers and with."""
    rough = [Drawing(d.points + 0.01 * (np.arange(len(d.points)) % 2)[:, None], d.times)
             for d in fan()]  # fmt: skip
    sketch = add_sketch(rough)
    modify(sketch)
    bpy.context.view_layer.update()
    plain, said = read_object(sketch)
    assert said == [f"Modifiers do not count ({sketch.modifiers[0].name}): switch on Modifiers"]
    evaluated, said = read_object(sketch, modifiers=True)
    assert not said
    return plain, evaluated


def test_an_array_adds_strokes_as_fast_as_the_first():
    plain, evaluated = read_evaluated(array)
    assert len(evaluated) == 2 * len(plain)
    for at, drawing in enumerate(evaluated):
        source = plain[at % len(plain)]
        offset = drawing.points - source.points
        assert np.allclose(offset, 0, atol=1e-6) or np.allclose(offset, (0, 0, 0.7), atol=1e-6)
        np.testing.assert_allclose(drawing.times, source.times)


def test_build_shows_the_strokes_that_are_there_by_now():
    plain, evaluated = read_evaluated(build)
    assert 0 < sum(len(one.points) for one in evaluated) < sum(len(one.points) for one in plain)
    for drawing in evaluated:
        assert any(np.allclose(drawing.points[0], one.points[0], atol=1e-6) for one in plain)
        assert (np.diff(drawing.times) >= 0).all(), "as they were drawn"


def test_smooth_takes_the_jitter_and_leaves_the_times():
    plain, evaluated = read_evaluated(smooth)
    for rough, even in zip(plain, evaluated, strict=True):
        np.testing.assert_allclose(even.times, rough.times)
        bends = [np.abs(np.diff(one.points, n=2, axis=0)).max() for one in (rough, even)]
        assert bends[1] < 0.2 * bends[0]


@pytest.mark.parametrize("modify", [array, build])
def test_a_splash_is_made_of_what_modifiers_leave(modify):
    add_sketch(fan())
    modify(bpy.context.active_object)
    without = vertices(generate()).copy()
    splash = generate(use_modifiers=True)
    assert "Modifiers do not count" not in splash.splash.warnings
    found, before = vertices(splash), without
    if modify is array:
        assert found[:, 2].max() > before[:, 2].max() + 0.5
    else:
        assert found[:, 0].max() < 0.8 * before[:, 0].max()


def test_modifiers_that_are_switched_off_are_no_matter():
    sketch = add_sketch(fan())
    sketch.modifiers.new("Offset", "GREASE_PENCIL_OFFSET").show_viewport = False
    assert not generate().splash.warnings


def test_a_masked_layer_is_said():
    sketch = add_sketch(fan())
    own_layer(sketch)
    layer = sketch.data.layers[0]
    layer.use_masks = True
    bpy.context.view_layer.objects.active = sketch
    sketch.data.layers.active = layer
    assert bpy.ops.grease_pencil.layer_mask_add(name="Extra") == {"FINISHED"}
    assert f"Layer '{layer.name}' is masked" in generate().splash.warnings
