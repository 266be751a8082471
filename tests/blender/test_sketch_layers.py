# SPDX-License-Identifier: GPL-3.0-or-later
"""A splash for each layer of a sketch; only what has changed is made again."""

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.data import stored_liquid
from liquid_splash_addon.blender.jobs import generate as generate_job
from liquid_splash_addon.blender.scene import sketch as sketches
from tests.blender.modelling import bounds, crossing, generate_layers, layered, part, the_model
from tests.blender.sketching import fan, line, splashes, vertices

pytestmark = pytest.mark.usefixtures("thick_drafts")


def test_only_the_layer_that_changed_is_made_anew(monkeypatch):
    sketch = crossing()
    model = generate_layers(sketch)
    asked, plain = [], generate_job.compute
    monkeypatch.setattr(
        generate_job,
        "compute",
        lambda run, report: (asked.append(run.layer), plain(run, report))[1],
    )
    kept = stored_liquid.read(part("A").data)[0], vertices(part("A"))
    before = vertices(model)
    generate_layers(sketch)
    assert asked == []
    np.testing.assert_array_equal(vertices(model), before)
    sketches.add_strokes(sketch, [line((0, 0.4, 0), (0.2, 0.9, 0))], sketch.data.layers["B"])
    generate_layers(sketch)
    assert asked == ["B"]
    assert stored_liquid.read(part("A").data)[0] == kept[0]
    np.testing.assert_array_equal(vertices(part("A")), kept[1])
    assert vertices(model).shape != before.shape
    part("A").splash.settings.seed, part("A").splash.settings.variation = 3, 0.5
    generate_layers(sketch)
    assert asked == ["B", "A"], "its own settings count, too"
    assert len(splashes()) == 2 and the_model() == model


def test_a_new_layer_joins_the_model_and_a_hidden_one_stays_as_it_is():
    sketch = crossing()
    model = generate_layers(sketch)
    layer = sketch.data.layers.new("C")
    layer.frames.new(bpy.context.scene.frame_current)
    sketches.add_strokes(sketch, [line((0, 0, 0.4), (0.8, 0, 0.5))], layer)
    sketch.data.layers["A"].hide = True
    generate_layers(sketch)
    assert [item.name for item in model.splash_model.parts] == ["Splash A", "Splash B", "Splash C"]
    assert not model.splash_model.warnings
    assert bounds(model)[1, 2] > 0.5


def test_a_deleted_layer_keeps_its_splash_with_a_warning():
    sketch = crossing()
    model = generate_layers(sketch)
    before = vertices(model)
    sketch.data.layers.remove(sketch.data.layers["B"])
    generate_layers(sketch)
    assert "'B'" in part("B").splash.warnings and "deleted" in part("B").splash.warnings
    np.testing.assert_array_equal(vertices(model), before)
    model.splash_model.active = 1
    bpy.context.view_layer.objects.active = model
    with pytest.raises(RuntimeError, match="deleted or renamed"):
        bpy.ops.splash.regenerate()
    part("B").splash.layer = "A"
    assert bpy.ops.splash.regenerate() == {"FINISHED"}, "another layer can be chosen"


def test_a_layer_that_gives_nothing_does_not_stop_the_others():
    sketch = layered(fan(), [line((0, 0, 0), (0, 0, 0))])
    assert bpy.ops.splash.generate_layers() == {"FINISHED"}
    assert [item.splash.layer for item in splashes()] == ["A"]
    sketch.data.layers.remove(sketch.data.layers["A"])
    bpy.context.view_layer.objects.active = sketch
    with pytest.raises(RuntimeError, match="Layer 'B'"):
        bpy.ops.splash.generate_layers()
