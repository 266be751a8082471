# SPDX-License-Identifier: GPL-3.0-or-later
"""Any size, from a thimble to a harbour wave, by Froude similarity."""

from dataclasses import replace

import numpy as np
import pytest

from liquid_splash_addon.core.condition import similarity
from liquid_splash_addon.core.condition.voxelize import outside_share
from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.pipeline import fits, make_splash
from liquid_splash_addon.core.scale import GRAVITY, Scale
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from liquid_splash_addon.core.sketch.local_frame import fit_frame
from liquid_splash_addon.core.sketch.presets import example_sketch
from liquid_splash_addon.core.sketch.strokes import Stroke
from tests.core.sketching import line

DRAFT = SplashSettings(resolution="64", device="CPU", speed_gain=1.0, breakup=0.0)
USUAL = 0.33


@pytest.fixture(scope="module")
def generator():
    """Return the bundled generator."""
    return load_generator(device="CPU")


def sketch() -> list[Stroke]:
    """Return the crown with its velocities."""
    return strokes_from_drawings(example_sketch("crown"), DRAFT)[0]


def at_froude(size: float) -> list[Stroke]:
    """Return the sketch at the Froude number that it has at its usual size."""
    return [Stroke(s.points, s.velocities * np.sqrt(USUAL / size)) for s in sketch()]


def made(generator, size: float, **settings):
    """Return its splash at that Froude number."""
    return make_splash(at_froude(size), replace(DRAFT, real_size=size, **settings), generator)


@pytest.mark.parametrize("size", [0.002, 0.02, 0.6, 12.0, 450.0])
def test_sizes_outside_the_trained_range_look_as_the_nearest_inside(generator, size):
    splash = made(generator, size)
    points = np.concatenate([stroke.points for stroke in sketch()])
    assert np.ptp(splash.mesh.vertices, axis=0).max() < 1.3 * np.ptp(points, axis=0).max()
    again = made(generator, 2 * size if size > similarity.SMALLEST else size / 2)
    assert len(again.mesh.vertices) == pytest.approx(len(splash.mesh.vertices), rel=0.01)
    speeds = [np.linalg.norm(one.mesh.velocities, axis=1).mean() for one in (splash, again)]
    ratio = again.frame.scale.length / splash.frame.scale.length
    # In drawing units: real speeds go by the root of the ratio.
    assert speeds[1] / speeds[0] == pytest.approx(ratio**-0.5, rel=0.01)


def test_sizes_that_were_trained_on_are_seen_as_they_are(generator):
    for size in (0.1, 0.2, 0.33):
        splash = made(generator, size)
        assert splash.regime == "" and splash.fields.grid == Grid.local(64)


def test_the_liquid_is_kept_in_real_metres_and_seconds(generator):
    splash = made(generator, 12.0)
    assert splash.frame.scale.time == 1.0
    assert splash.frame.scale.gravity * splash.frame.scale.length == pytest.approx(GRAVITY)
    speeds = np.linalg.norm(splash.fields.velocity, axis=0)
    drawn = np.concatenate([np.linalg.norm(s.velocities, axis=1) for s in splash.strokes])
    assert np.median(speeds[speeds > 0]) == pytest.approx(np.median(drawn), rel=0.5)
    assert splash.fields.grid.size[0] == pytest.approx(12.0, rel=0.4)
    assert "12 m splash" in splash.regime and "Froude" in splash.regime


def test_surface_tension_is_that_of_the_real_size(generator):
    """What breaks a small splash up leaves a wave alone, and the film of a wave is a slab."""

    def changed(size: float) -> float:
        whole, parted = (made(generator, size, breakup=b).fields.occupancy > 0.5 for b in (0, 10))
        return float((whole != parted).sum() / whole.sum())

    assert changed(20.0) == 0.0 < changed(0.33)


@pytest.mark.parametrize("size", [0.003, 0.5, 3.0, 40.0])
def test_strokes_always_fit_the_box(size):
    frame = fit_frame(sketch(), size)
    local = frame.strokes_to_local(sketch())
    model = similarity.model_scale(local)
    seen = frame.seen_as(model).strokes_to_local(sketch())
    assert outside_share(seen, Grid.local()) < similarity.LEAST_OUTSIDE
    assert model.time == pytest.approx(model.length**0.5)
    assert fits(sketch(), frame, size)
    far = [*sketch(), line((0.3, 0, 0.2), (9.0, 0, 6.0))]
    assert not fits(far, frame, size) or size < similarity.SMALLEST


def test_a_model_and_back():
    model = Scale.similar(1 / 25)
    assert model.lengths_to_local(10.0) == pytest.approx(0.4)
    assert model.velocities_to_local(10.0) == pytest.approx(2.0)
    assert model.durations_to_local(1.0) == pytest.approx(0.2)
    assert model.gravity == pytest.approx(GRAVITY)
    twice = Scale(2.0, 3.0).then(model)
    assert twice.lengths_to_local(1.0) == pytest.approx(model.lengths_to_local(2.0))
    assert twice.durations_to_local(1.0) == pytest.approx(model.durations_to_local(3.0))


@pytest.mark.parametrize(
    ("metres", "words"), [(12.3, "12 m"), (0.1, "10 cm"), (0.004, "4 mm"), (150.0, "150 m")]
)
def test_lengths_in_words(metres, words):
    assert similarity.length_in_words(metres) == words
