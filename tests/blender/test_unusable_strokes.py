# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes that cannot be used are left out, said and shown; the others make the splash."""

import bpy
import numpy as np
import pytest

from liquid_splash_addon.core.sketch.drawing import Drawing
from tests.blender.sketching import add_sketch, fan, generate, vertices

TAP = Drawing(np.full((1, 3), 0.2), np.zeros(1))
STILL = Drawing(np.full((4, 3), 0.2), np.arange(4.0))
LOST = Drawing(np.array([(0, 0, 0), (np.nan, 0, 0), (1, 0, 0)]), np.arange(3.0))

pytestmark = pytest.mark.usefixtures("tubes")


@pytest.mark.parametrize("bad", [TAP, STILL, LOST], ids=["tap", "still", "not a number"])
@pytest.mark.parametrize("place", [0, 3, 6])
def test_one_bad_stroke_changes_nothing_but_a_warning(bad, place):
    add_sketch(fan())
    expected = vertices(generate())
    drawings = fan()
    drawings.insert(place, bad)
    add_sketch(drawings)
    generate()
    splash = bpy.context.active_object
    np.testing.assert_array_equal(vertices(splash), expected)
    assert "Left out 1 stroke(s)" in splash.splash.warnings
    assert "Select Strokes" in splash.splash.warnings


def selected(sketch: bpy.types.Object) -> list[int]:
    strokes = sketch.data.layers[0].frames[0].drawing.strokes
    return [number for number, stroke in enumerate(strokes) if stroke.select]


def test_select_strokes_shows_them_and_they_can_be_deleted():
    sketch = add_sketch([TAP, *fan(), STILL])
    generate()
    assert bpy.ops.splash.select_strokes() == {"FINISHED"}
    assert bpy.context.active_object == sketch and sketch.mode == "EDIT"
    assert selected(sketch) == [0, 7]
    # Not the operator that deletes what is selected: it crashes Blender 5.0.1 without a window.
    sketch.data.layers[0].frames[0].drawing.remove_strokes(indices=selected(sketch))
    bpy.ops.object.mode_set(mode="OBJECT")
    assert not generate().splash.warnings


def test_select_strokes_of_a_good_sketch_says_so():
    add_sketch(fan())
    assert bpy.ops.splash.select_strokes() == {"CANCELLED"}


def test_a_sketch_of_taps_is_refused():
    add_sketch([TAP, TAP])
    with pytest.raises(RuntimeError, match="None of the 2 stroke"):
        generate()
    assert not bpy.data.meshes


def test_changing_layer_or_sketch_keeps_what_is_refined():
    """Until it is made anew, the splash is the liquid that it stores."""
    add_sketch(fan())
    splash = generate()
    other = add_sketch(fan(), active=False)
    splash.splash.sketch = other
    bpy.context.view_layer.objects.active = splash
    assert bpy.ops.splash.refinement_add(kind="WAVES") == {"FINISHED"}
    assert not splash.splash_stack.warnings
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
