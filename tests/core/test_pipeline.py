# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes to splash with the bundled weights."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

pytest.importorskip("torch")

from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.pipeline import make_splash
from liquid_splash_addon.core.progress import Cancelled
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from liquid_splash_addon.core.sketch.presets import SKETCHES, example_sketch
from liquid_splash_addon.core.sketch.strokes import Stroke, StrokeError, resampled_points

from .sketching import line, moved

DRAFT = SplashSettings(resolution="64", device="CPU")


@pytest.fixture(scope="module")
def generator():
    """Return the bundled generator."""
    return load_generator(device="CPU")


def sketch(name="crown") -> list[Stroke]:
    """Return a bundled sketch with its velocities."""
    return strokes_from_drawings(example_sketch(name), DRAFT)[0]


def mean_distance(a, b):
    """Return the mean distance of each set of points to the other."""
    return (cKDTree(a).query(b)[0].mean() + cKDTree(b).query(a)[0].mean()) / 2


@pytest.mark.parametrize("name", SKETCHES)
def test_a_splash_follows_its_strokes(generator, name):
    strokes = sketch(name)
    splash = make_splash(strokes, DRAFT, generator)
    cell = splash.fields.grid.spacing / splash.frame.scale.length
    points, velocities = resampled_points(strokes, cell / 2)
    away, nearest = cKDTree(splash.mesh.vertices).query(points)
    assert (away < 4 * cell).mean() > 0.9
    drawn = DRAFT.speed_gain * velocities
    found = splash.mesh.velocities[nearest]
    speed, expected = np.linalg.norm(found, axis=1), np.linalg.norm(drawn, axis=1)
    assert np.median(speed) / np.median(expected) == pytest.approx(1, abs=0.3)
    cosine = (found * drawn).sum(1) / np.maximum(speed * expected, 1e-9)
    assert cosine.mean() > 0.7


def test_same_seed_same_mesh_and_other_seed_other_mesh(generator):
    settings = replace(DRAFT, variation=1.0)
    first, same = (make_splash(sketch(), settings, generator).mesh for _ in range(2))
    assert first.vertices.tobytes() == same.vertices.tobytes()
    assert first.velocities.tobytes() == same.velocities.tobytes()
    other = make_splash(sketch(), replace(settings, seed=1), generator).mesh
    assert first.vertices.shape != other.vertices.shape or not np.allclose(
        first.vertices, other.vertices
    )


@pytest.mark.parametrize(("resolution", "missing"), [("128", 0.05), ("64", 0.15)])
@pytest.mark.parametrize("name", SKETCHES)
def test_the_mesh_holds_the_occupied_volume(generator, name, resolution, missing):
    splash = make_splash(sketch(name), replace(DRAFT, resolution=resolution), generator)
    a, b, c = (splash.mesh.vertices[splash.mesh.faces[:, n]].astype(float) for n in range(3))
    volume = (np.cross(a, b) * c).sum() / 6
    cell = splash.fields.grid.spacing / splash.frame.scale.length
    assert volume / cell**3 == pytest.approx((splash.fields.occupancy > 0.5).sum(), rel=missing)


@pytest.mark.parametrize("name", SKETCHES)
def test_turned_and_moved_strokes_give_the_splash_turned_and_moved(generator, name):
    rotation = Rotation.random(random_state=3).as_matrix()
    shift = np.array([3.0, -1.0, 2.0])
    here = make_splash(sketch(name), DRAFT, generator)
    there = make_splash(moved(sketch(name), rotation, shift), DRAFT, generator)
    cell = here.fields.grid.spacing / here.frame.scale.length
    assert mean_distance(here.mesh.vertices @ rotation.T + shift, there.mesh.vertices) < cell / 2


def test_a_stored_frame_is_kept(generator):
    splash = make_splash(sketch(), DRAFT, generator)
    edited = [*sketch(), line((0.3, 0, 0.2), (0.9, 0, 0.6), speed=4.0)]
    assert make_splash(edited, DRAFT, generator, frame=splash.frame).frame is splash.frame


def test_strokes_that_outgrow_a_stored_frame_are_made_smaller_with_it(generator):
    splash = make_splash(sketch(), DRAFT, generator)
    wall = Grid.local().size[0] / 2
    begin, end = splash.frame.points_to_drawing(np.array([(0, 0, 0), (1.2 * wall, 0, 0)]))
    grown = make_splash(
        [*sketch(), line(begin, end, speed=4.0)], DRAFT, generator, frame=splash.frame
    )
    assert grown.frame is splash.frame and "Froude" in grown.regime
    away = np.linalg.norm(grown.mesh.vertices - end, axis=1).min()
    assert away < 0.1 * np.linalg.norm(end - begin), "there is liquid beyond the wall"


def test_strokes_that_left_a_stored_frame_ask_for_another(generator):
    splash = make_splash(sketch(), DRAFT, generator)
    far = [*sketch(), line((0.3, 0, 0.2), (9.0, 0, 6.0), speed=4.0)]
    with pytest.raises(StrokeError, match="Refit to Sketch"):
        make_splash(far, DRAFT, generator, frame=splash.frame)
    assert np.ptp(make_splash(far, DRAFT, generator).mesh.vertices, axis=0).max() > 8


def test_speeds_beyond_training_are_reported(generator):
    assert make_splash(sketch(), DRAFT, generator).warnings == []
    (warning,) = make_splash(sketch(), replace(DRAFT, speed_gain=20.0), generator).warnings
    assert "Fit Speed lowers Speed Gain" in warning


def test_cancelling_stops_between_stages(generator):
    stages = []

    def report(stage, share):
        stages.append(stage)
        if len(stages) == 2:
            raise Cancelled

    with pytest.raises(Cancelled):
        make_splash(sketch(), DRAFT, generator, report=report)
    assert len(stages) == 2


def test_draft_and_full_resolution_agree(generator):
    draft = make_splash(sketch(), DRAFT, generator)
    full = make_splash(sketch(), replace(DRAFT, resolution="128"), generator)
    cell = draft.fields.grid.spacing / draft.frame.scale.length
    assert mean_distance(draft.mesh.vertices, full.mesh.vertices) < 2 * cell
