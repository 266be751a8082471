# SPDX-License-Identifier: GPL-3.0-or-later
"""Flow On: kept with the splash, at the head of its refinements, and never live."""

import bpy
import numpy as np
import pytest

from liquid_splash_addon.blender.data import stored_liquid
from liquid_splash_addon.blender.jobs import flow_on, refine
from liquid_splash_addon.blender.ui.refinement_panel import SPLASH_PT_refinements
from liquid_splash_addon.core.refinement.stored_splash import StoredSplash
from tests.blender.drawing_panels import drawn
from tests.blender.modelling import crossing, generate_layers
from tests.blender.sketching import add_sketch, fan, generate, vertices

pytestmark = pytest.mark.once

OUT_OF_DATE = "Flow On is out of date"


@pytest.fixture
def splash(tubes) -> bpy.types.Object:
    """A splash, active."""
    add_sketch(fan())
    return generate()


def flown(splash: bpy.types.Object, milliseconds: float) -> np.ndarray:
    """Set the slider, press the button and return the vertices."""
    bpy.context.view_layer.objects.active = splash
    splash.splash_stack.flow_on.milliseconds = milliseconds
    assert bpy.ops.splash.flow_on() == {"FINISHED"}
    return vertices(splash)


def stored(splash: bpy.types.Object) -> StoredSplash:
    return StoredSplash.from_bytes(stored_liquid.read(splash.data)[0])


def direct(splash: bpy.types.Object) -> np.ndarray:
    """Return the vertices that what is stored gives."""
    refine.refiner = None
    return refine.compute(refine.task_of(splash), lambda stage, share: None).mesh.vertices


def tip(places: np.ndarray) -> float:
    """Return how far the jets have come that fan out along x."""
    return float(np.sort(places[:, 0])[-20:].mean())


def test_the_splash_has_moved_as_its_velocity_says(splash):
    first = flown(splash, 4.0)
    velocity = vertices(splash, "velocity")[np.argsort(first[:, 0])[-20:], 0].mean()
    pace = velocity / splash.splash_motion.time_scale  # of the liquid, units a second
    after = flown(splash, 12.0)
    assert tip(after) - tip(first) == pytest.approx(0.008 * pace, rel=0.3) and pace > 0
    assert stored(splash).flowed.milliseconds == 12.0
    np.testing.assert_array_equal(after, direct(splash))


def test_the_slider_alone_changes_nothing_and_is_marked(splash):
    assert OUT_OF_DATE not in drawn(SPLASH_PT_refinements)
    before = vertices(splash)
    splash.splash_stack.flow_on.milliseconds = 5.0
    np.testing.assert_array_equal(vertices(splash), before)
    assert OUT_OF_DATE in drawn(SPLASH_PT_refinements)
    assert bpy.ops.splash.flow_on() == {"FINISHED"}
    assert OUT_OF_DATE not in drawn(SPLASH_PT_refinements)
    splash.splash_stack.flow_on.milliseconds = 0.0
    assert OUT_OF_DATE in drawn(SPLASH_PT_refinements)
    assert bpy.ops.splash.flow_on() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(splash), before)
    assert stored(splash).flowed is None and OUT_OF_DATE not in drawn(SPLASH_PT_refinements)


def test_refinements_stay_live_on_top(splash, tmp_path):
    bare = flown(splash, 5.0)
    bpy.ops.splash.refinement_add(kind="WAVES")
    waved = vertices(splash)
    assert waved.shape != bare.shape
    path, name = str(tmp_path / "flown.blend"), splash.name
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    splash = bpy.data.objects[name]
    bpy.context.view_layer.objects.active = splash
    assert OUT_OF_DATE not in drawn(SPLASH_PT_refinements)
    splash.splash_stack.items[0].show = False
    np.testing.assert_array_equal(vertices(splash), bare)
    splash.splash_stack.items[0].show = True
    np.testing.assert_array_equal(vertices(splash), waved)


def test_a_new_run_begins_before_it(splash):
    before = vertices(splash)
    flown(splash, 5.0)
    assert bpy.ops.splash.regenerate() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(splash), before)
    assert OUT_OF_DATE in drawn(SPLASH_PT_refinements)


def test_applied_refinements_flow_on_and_flow_is_applied(splash):
    flown(splash, 5.0)
    bpy.ops.splash.refinement_add(kind="WAVES")
    waved = vertices(splash)
    assert bpy.ops.splash.refinement_apply() == {"FINISHED"}
    np.testing.assert_array_equal(vertices(splash), waved)
    kept = stored(splash)
    assert kept.flowed is None and kept.applied is not None
    assert splash.splash_stack.flow_on.milliseconds == 0 and flow_on.is_up_to_date(splash)
    again = flown(splash, 5.0)
    assert tip(again) > tip(waved) + 0.01


def test_a_model_shows_a_splash_that_has_flown_on(thick_drafts):
    model = generate_layers(crossing())
    part = model.splash_model.parts[0].splash
    before = vertices(model)
    flown(part, 5.0)
    bpy.context.view_layer.update()
    assert vertices(model).shape != before.shape


def test_a_threshold_that_was_changed_is_marked(splash):
    flown(splash, 5.0)
    splash.splash.settings.surface_threshold = 0.4
    assert OUT_OF_DATE in drawn(SPLASH_PT_refinements)
