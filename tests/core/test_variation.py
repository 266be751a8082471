# SPDX-License-Identifier: GPL-3.0-or-later
"""Splashes of different seeds differ where an eye sees it, and still are what was drawn."""

from itertools import combinations

import numpy as np
import pytest

from liquid_splash_addon.core.grid import LOCAL_SPACING
from liquid_splash_addon.core.mesh.marching_cubes import surface
from liquid_splash_addon.core.pipeline import make_splash
from liquid_splash_addon.core.refinement.presets import PRESETS
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from liquid_splash_addon.core.sketch.presets import example_sketch
from liquid_splash_addon.core.sketch.strokes import Stroke
from liquid_splash_addon.core.sketch.variation import LONGEST, MOST_SWAY, SHORTEST, varied


def fan(strokes: int = 6, points: int = 60) -> list[Stroke]:
    """Return strokes that fan out in a plane, 20 cm long, at 2 m/s."""
    found = []
    for angle in np.linspace(-0.5, 0.5, strokes):
        way = np.array([np.cos(angle), np.sin(angle), 0.0])
        along = np.linspace(0.0, 0.2, points)[:, None] * way - (0.1, 0, 0)
        found.append(Stroke(along, np.tile(2 * way, (points, 1))))
    return found


def test_without_variation_every_seed_is_the_same():
    strokes = fan()
    assert varied(strokes, 1, 0.0) is strokes and varied(strokes, 2, 0.0) is strokes


def test_a_seed_gives_the_same_warp_again_and_others_other_ones():
    first, again, other = (varied(fan(), seed, 1.0) for seed in (4, 4, 5))
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a.points, b.points)
    assert max(abs(a.length - b.length) for a, b in zip(first, other, strict=True)) > 0.01


@pytest.mark.parametrize("seed", range(6))
def test_strokes_begin_where_they_did_and_stay_near(seed):
    for before, after in zip(fan(), varied(fan(), seed, 1.0), strict=True):
        np.testing.assert_allclose(after.points[0], before.points[0], atol=1e-6)
        assert 1 + SHORTEST - 0.03 < after.length / before.length < 1 + LONGEST + 0.03
        way = before.velocities[0] / np.linalg.norm(before.velocities[0])
        off = after.points - before.points[0]
        assert np.linalg.norm(off - (off @ way)[:, None] * way, axis=1).max() < MOST_SWAY + 1e-6


def test_velocities_lead_along_the_warped_strokes():
    for stroke in varied(fan(), 2, 1.0):
        way = np.gradient(stroke.points.astype(np.float64), axis=0)[1:-1]
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        speed = np.linalg.norm(stroke.velocities[1:-1], axis=1)
        assert ((stroke.velocities[1:-1] * way).sum(axis=1) / speed).min() > np.cos(np.radians(2))
        assert 1.5 < speed.min() and speed.max() < 2.5, "no more than strokes stretch"


def test_neighbours_go_together():
    """Two strokes a cell apart are a cell apart still, within a third."""
    near = [Stroke(s.points + (0, 0, z), s.velocities) for s in fan(1) for z in (0, LOCAL_SPACING)]
    one, two = varied(near, 3, 1.0)
    count = min(len(one.points), len(two.points))
    gap = np.linalg.norm(one.points[:count] - two.points[:count], axis=1) / LOCAL_SPACING
    assert abs(gap - 1).max() < 0.33


def test_strokes_near_the_walls_stay_inside():
    strokes = [Stroke(s.points + (0.09, 0, 0), s.velocities) for s in fan()]
    for stroke in varied(strokes, 0, 1.0):
        assert np.abs(stroke.points).max() < 0.2


def test_strokes_of_equal_points_are_left_alone():
    point = Stroke(np.zeros((3, 3)), np.ones((3, 3)))
    for stroke in varied([*fan(2), point], 0, 1.0):
        assert np.isfinite(stroke.points).all() and np.isfinite(stroke.velocities).all()


def apart(one, two) -> np.ndarray:
    """Return the distances of each surface's vertices to the other's nearest, m."""
    from scipy.spatial import cKDTree

    found = [cKDTree(b.vertices).query(a.vertices)[0] for a, b in ((one, two), (two, one))]
    return np.concatenate(found)


def sketch(name: str):
    """Return the strokes of a sketch that seeds are compared on."""
    if name == "fan":
        return fan(), SplashSettings(real_size=0.0, variation=1.0)
    settings = SplashSettings(variation=1.0)
    return strokes_from_drawings(example_sketch(name), settings)[0], settings


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "least", "least_of_most"),
    # The wave fills its box: its strokes cannot fly on, so its liquid alone differs least.
    [("fan", 0.01, 0.03), ("crown", 0.008, 0.024), ("wave", 0.006, 0.014)],
)
def test_seeds_differ_at_a_glance_and_cover_their_strokes(name, least, least_of_most):
    """least, least_of_most : of the liquid; with the films and drops of new splashes 1 and 3 %."""
    from dataclasses import replace

    from scipy.spatial import cKDTree

    from liquid_splash_addon.core.generator.loading import load_generator

    generator = load_generator(device="CPU")
    strokes, settings = sketch(name)
    meshes, refined = [], []
    for seed in range(6):
        wanted = replace(settings, seed=seed)
        splash = make_splash(strokes, wanted, generator, refinements=PRESETS["FRESH"].steps)
        mesh = surface(splash.fields, settings.surface_threshold)
        meshes.append(mesh)
        refined.append(splash.mesh)
        drawn = np.concatenate([s.points for s in splash.strokes])
        level = splash.fields.occupancy > settings.surface_threshold
        inside = level[tuple(splash.fields.grid.cell_of(drawn).clip(0, 127).T)]
        away = cKDTree(mesh.vertices).query(drawn)[0]
        covered = float(np.mean(inside | (away < 2 * LOCAL_SPACING)))
        print(f"{name} seed {seed}: covered {covered:.3f}")
        assert covered > 0.9
    for stage, made, bounds in (
        ("bare", meshes, (least, least_of_most)),
        ("as new splashes are", refined, (0.01, 0.03)),
    ):
        size = max(float(np.ptp(mesh.vertices, axis=0).max()) for mesh in made)
        for a, b in combinations(range(6), 2):
            far = apart(made[a], made[b]) / size
            mean, most = float(far.mean()), float(np.quantile(far, 0.95))
            print(f"{name} {stage}, seeds {a}, {b}: mean {mean:.4f}, 95 % {most:.4f}")
            assert mean > bounds[0] and most > bounds[1]
