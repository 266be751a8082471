# SPDX-License-Identifier: GPL-3.0-or-later
"""Thin liquid that surface tension breaks up."""

import numpy as np
import pytest
from scipy.ndimage import label

from liquid_splash_addon.core.fluid.surface_tension import WATER
from liquid_splash_addon.core.grid import LOCAL_SPACING, Grid
from liquid_splash_addon.core.liquid import breakup, flight
from liquid_splash_addon.core.liquid.breakup import broken_up, disturbance, growth, thinning
from liquid_splash_addon.core.liquid.fields import AIR, Fields, clip_to_band
from liquid_splash_addon.core.liquid.flight import flown
from liquid_splash_addon.core.liquid.level_set import LevelSet, surface_level
from liquid_splash_addon.core.liquid.shaping import reshaped
from liquid_splash_addon.core.liquid.volume import filled_cells
from liquid_splash_addon.core.mesh.marching_cubes import surface
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.strokes import Stroke
from tests.core.sketching import line

LENGTH = 0.25
"""Of the liquid and its stroke along x, metres."""

SLOW, FAST = 0.6, 6.0
"""m/s."""


def stroke(speed):
    """Return a stroke along the liquid, from its low end to its high end."""
    return line((-LENGTH / 2, 0, 0), (LENGTH / 2, 0, 0), speed=speed)


def liquid(cells=128, half=(LENGTH / 2, 0.05, 1.5 * LOCAL_SPACING), speed=1.0) -> Fields:
    """Return a slab in the local box, ``half`` its sides in metres, that flows along x."""
    grid = Grid.local(cells)
    out = (np.abs(grid.centres()) - np.array(half)) / grid.spacing
    away = np.linalg.norm(np.maximum(out, 0), axis=-1) + np.minimum(out.max(axis=-1), 0)
    occupancy = (1 / (1 + np.exp(2 * away))).astype(np.float32)
    velocity = np.zeros((3, *away.shape), dtype=np.float32)
    velocity[0] = speed
    return clip_to_band(occupancy, away.astype(np.float32), velocity, grid)


def parted_by_tension(fields, strokes, settings) -> Fields:
    """Return the liquid that has flown along ``strokes``."""
    return reshaped(fields, lambda liquid: broken_up(liquid, strokes, settings))


def broken(speed, settings=None, **shape) -> Fields:
    """Return the slab after it has flown along its stroke."""
    return parted_by_tension(liquid(**shape), [stroke(speed)], settings or SplashSettings())


def holes(fields):
    """Return the share of the slab's middle plane that has become air, along its length."""
    middle = liquid(fields.grid.shape[0]).occupancy.shape[2] // 2
    was = liquid(fields.grid.shape[0]).occupancy[:, :, middle] > 0.5
    lost = was & (fields.occupancy[:, :, middle] <= 0.5)
    return lost.sum(axis=1) / np.maximum(was.sum(axis=1), 1)


def volume(fields):
    """Return the volume under the surface, cells."""
    return filled_cells(surface_level(fields, 0.5))


def test_a_slow_sheet_parts_and_a_fast_one_does_not():
    before = liquid()
    fast = broken(FAST)
    assert (fast.occupancy == before.occupancy).all()
    slow = broken(SLOW)
    assert holes(slow).mean() > 0.1
    assert label(slow.occupancy > 0.5)[1] > 1


def test_what_has_flown_longer_has_parted_more():
    lost = holes(broken(SLOW))
    start, end = lost[:64], lost[64:]
    assert start.mean() < 0.3 * end.mean()
    backwards = parted_by_tension(
        liquid(), [line((LENGTH / 2, 0, 0), (-LENGTH / 2, 0, 0), speed=SLOW)], SplashSettings()
    )
    turned = holes(backwards)
    assert turned[64:].mean() < 0.3 * turned[:64].mean()


def test_thick_liquid_stays_whole():
    half = (LENGTH / 2, 0.04, 0.04)
    before, after = liquid(half=half), broken(SLOW, half=half)
    changed = (before.occupancy > 0.5) != (after.occupancy > 0.5)
    assert changed.sum() < 0.01 * (before.occupancy > 0.5).sum()


def test_the_volume_stays_and_all_fields_agree():
    before, after = liquid(), broken(SLOW)
    wet = after.occupancy > 0.5
    assert volume(after) == pytest.approx(volume(before), rel=0.02)
    assert ((after.distance < 0) == wet).all()
    assert (np.abs(after.distance) <= AIR).all()
    assert not after.velocity[:, after.distance >= AIR].any()
    # The mesh's vertices have the liquid's velocity where it has swollen, too.
    mesh = surface(after)
    assert np.median(mesh.velocities[:, 0]) == pytest.approx(1.0)
    assert np.quantile(mesh.velocities[:, 0], 0.02) > 0.8
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()


@pytest.mark.parametrize("threshold", (0.1, 0.9))
def test_other_thresholds_are_fuller_and_thinner_as_before(threshold):
    before, after = (filled_cells(surface_level(f, threshold)) for f in (liquid(), broken(SLOW)))
    assert after == pytest.approx(before, rel=0.35)


def test_the_distance_is_one():
    before, after = liquid(), broken(SLOW)
    true = LevelSet.of(after).distance
    changed = (after.distance != before.distance) & (np.abs(true) < 2)
    assert np.quantile(np.abs(after.distance - true)[changed], 0.95) < 0.3


def test_liquid_flows_where_the_generator_told_no_velocity():
    fields = liquid()
    fields.velocity[:, fields.distance > 1.5] = 0
    fields.distance[fields.distance > 1.5] = AIR
    known = fields.distance < AIR
    after = parted_by_tension(fields, [stroke(SLOW)], SplashSettings())
    grown = (after.occupancy > 0.5) & ~known
    assert grown.any() and (after.velocity[0][grown] == 1).all()


def test_what_is_stored_comes_back():
    after = broken(SLOW).round_off()
    again = Fields.from_arrays(after.to_arrays())
    for name in ("occupancy", "distance", "velocity"):
        assert (getattr(again, name) == getattr(after, name)).all()


def test_without_surface_tension_nothing_changes():
    fields = liquid()
    before = fields.occupancy.copy()
    assert parted_by_tension(fields, [stroke(SLOW)], SplashSettings(breakup=0.0)) is fields
    assert (fields.occupancy == before).all()


def test_more_surface_tension_breaks_faster_liquid():
    lost = [holes(broken(2.0, SplashSettings(breakup=b))).mean() for b in (1.0, 4.0, 10.0)]
    assert lost[0] < 0.02 < 0.5 * lost[2] and lost[0] <= lost[1] < lost[2]


def test_it_grows_as_rayleigh_says():
    # A thread of water 2 mm thick: sqrt(rho a^3 / sigma) is 3.7 ms; e-fold in 10.8 ms.
    rate, half = breakup.GROWTH * np.sqrt(WATER), 0.001
    efold = 1 / rate * half**1.5
    assert efold == pytest.approx(0.0108, rel=0.01)
    sizes = growth(rate, efold * np.array([2.0, 3.0]), half) + breakup.SLIGHT
    assert sizes == pytest.approx(breakup.DISTURBANCE * np.expm1([2.0, 3.0]))
    assert growth(rate, 0.0, half) == 0
    assert growth(rate, 100.0, half) == breakup.GROWTH_MOST


def test_times_of_flight():
    points, ages = flown([stroke(2.0)])
    assert points[0, 0] == pytest.approx(-LENGTH / 2) and ages[0] == 0
    np.testing.assert_allclose(ages, (points[:, 0] + LENGTH / 2) / 2.0, atol=1e-4)
    # No longer than FLIGHT metres at the speed there: a pen may go on.
    long = line((-0.6, 0, 0), (0.6, 0, 0), speed=2.0)
    assert flown([long])[1].max() == pytest.approx(flight.FLIGHT / 2.0)
    assert flown([])[1].size == 0


def test_a_pen_that_rests_does_not_age_the_liquid_for_ever():
    moving = stroke(2.0)
    velocities = moving.velocities.copy()
    velocities[len(velocities) // 2] = 0
    _, ages = flown([Stroke(moving.points, velocities)])
    assert np.isfinite(ages).all() and ages.max() <= flight.FLIGHT / flight.SLOWEST


def test_the_disturbance_is_even_and_a_matter_of_the_place_alone():
    still = LevelSet.of(liquid(half=(0.19, 0.19, 1.5 * LOCAL_SPACING)))
    places = np.random.default_rng(0).uniform([8, 8, 62], [120, 120, 66], size=(20000, 3))
    half = np.exp(np.random.default_rng(1).uniform(np.log(0.003), np.log(0.012), 20000))
    waves = disturbance(still, places, half, 0, 0.0)
    for wave in (waves.streaks, waves.beads):
        assert abs(wave.mean()) < 0.25 and wave.std() == pytest.approx(1.0, abs=0.2)
    again = disturbance(still, places[:7], half[:7], 0, 0.0)
    np.testing.assert_allclose(again.streaks, waves.streaks[:7], atol=1e-4)


def likeness(wet, step):
    """Return how alike cells of a plane are that lie ``step`` apart: 1 the same, 0 at random."""
    x, y = step
    near, far = wet[: wet.shape[0] - x, : wet.shape[1] - y], wet[x:, y:]
    return np.corrcoef(near.ravel(), far.ravel())[0, 1]


def test_a_sheet_parts_into_ligaments_along_the_flow():
    after = broken(SLOW)
    middle = after.occupancy.shape[2] // 2
    wet = (after.occupancy[76:112, 50:78, middle] > 0.5).astype(float)
    assert 0.1 < wet.mean() < 0.95
    assert likeness(wet, (4, 0)) > likeness(wet, (0, 4)) + 0.3


def test_strength_leads_from_a_fringe_to_ligaments_to_drops():
    weak, water, strong = (broken(SLOW, SplashSettings(breakup=b)) for b in (0.25, 1.0, 4.0))
    lost = [holes(fields) for fields in (weak, water, strong)]
    assert lost[0].mean() < 0.5 * lost[1].mean() < 0.5 * lost[2].mean()
    pieces = [label(fields.occupancy > 0.5)[1] for fields in (weak, water, strong)]
    assert pieces[0] < pieces[1] < 0.7 * pieces[2]


def test_a_fan_is_thinned_by_its_flow_and_a_stream_is_not():
    fields = liquid()
    cells = np.argwhere(np.abs(fields.grid.centres()[..., 2]) < 0.002)
    metres = fields.grid.to_metres(cells + 0.5)
    chosen = (metres[:, 0] > -0.05) & (metres[:, 0] < 0.1) & (np.abs(metres[:, 1]) < 0.03)
    places, normals = cells[chosen] + 0.5, np.tile([0.0, 0.0, 1.0], (chosen.sum(), 1))
    beyond = metres[chosen, 0] + LENGTH / 2
    assert thinning(LevelSet.of(fields), places, normals, beyond).max() < 1e-6
    around = fields.grid.centres() + np.array([LENGTH / 2, 0, 0])  # from one point, at 1 m/s
    radius = np.linalg.norm(around[..., :2], axis=-1)
    for axis in range(2):
        fields.velocity[axis] = (fields.distance < AIR) * around[..., axis] / radius
    found = thinning(LevelSet.of(fields), places, normals, np.hypot(beyond, metres[chosen, 1]))
    assert np.median(found) == pytest.approx(1.0, abs=0.02)


def test_seeds_part_elsewhere_only_where_they_may_vary():
    first, second = (broken(SLOW, SplashSettings(seed=seed)) for seed in (1, 2))
    assert (first.occupancy == second.occupancy).all()
    first, second, again = (
        broken(SLOW, SplashSettings(seed=seed, variation=1.0)) for seed in (1, 2, 1)
    )
    assert (first.occupancy == again.occupancy).all()
    assert ((first.occupancy > 0.5) != (second.occupancy > 0.5)).sum() > 500


def test_a_draft_parts_where_the_full_result_does():
    full, draft = broken(SLOW), broken(SLOW, cells=64)
    assert holes(draft).mean() > 0.1
    coarse = full.occupancy.reshape(64, 2, 64, 2, 64, 2).mean(axis=(1, 3, 5)) > 0.5
    fine = draft.occupancy > 0.5
    assert (coarse & fine).sum() / (coarse | fine).sum() > 0.5


def test_liquid_at_the_wall_of_the_box_and_liquid_without_strokes():
    wide = (0.25, 0.25, 1.5 * LOCAL_SPACING)
    after = broken(SLOW, half=wide)
    assert volume(after) == pytest.approx(volume(liquid(half=wide)), rel=0.02)
    assert label(after.occupancy > 0.5)[1] > 1
    fields = liquid(cells=64)
    assert parted_by_tension(fields, [], SplashSettings()) is fields


@pytest.mark.parametrize("speed", (0.05, 0.9, 1.3, 1.9))
@pytest.mark.parametrize("cells", (64, 128))
def test_no_speed_is_too_slow_or_nearly_fast_enough(speed, cells):
    before, after = liquid(cells), broken(speed, cells=cells)
    assert volume(after) == pytest.approx(volume(before), rel=0.05)
    assert np.isfinite(after.distance).all() and np.isfinite(after.velocity).all()
