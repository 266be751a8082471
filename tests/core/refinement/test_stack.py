# SPDX-License-Identifier: GPL-3.0-or-later
"""Droplets, ruptures, cleaning up, and the list of them."""

import itertools
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.ndimage import label

from liquid_splash_addon.core.mesh.marching_cubes import level_surface
from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.obstacles.obstacles import Obstacle, ObstacleError, obstacle_from_mesh
from liquid_splash_addon.core.refinement.cleanup import remove_specks
from liquid_splash_addon.core.refinement.droplets import add_droplets
from liquid_splash_addon.core.refinement.front import band_cells, break_measure, choose
from liquid_splash_addon.core.refinement.presets import PRESETS
from liquid_splash_addon.core.refinement.ruptures import add_ruptures
from liquid_splash_addon.core.refinement.settings import (
    KINDS,
    CleanupSettings,
    DropletSettings,
    RuptureSettings,
    SheetSettings,
    WaveSettings,
)
from liquid_splash_addon.core.refinement.stack import Refiner
from tests.core.refinement.shapes import GRID, ball, liquid_of, offsets, sheet

DROPS = DropletSettings(amount=0.03)


def signed_volume(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, n]].astype(float) for n in range(3))
    return float((np.cross(a, b) * c).sum() / 6)


def edge_uses(mesh: Mesh) -> np.ndarray:
    """Return how often each undirected edge is used; twice everywhere in a closed mesh."""
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    return np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)[1]


def test_curvature_of_a_ball():
    liquid = ball(10)
    cells = band_cells(liquid, inside=True)
    # alpha 0 leaves the curvature alone: 2 / r, with r from 8.4 to 10.
    bend = np.exp(break_measure(liquid, cells, 0.0, 1.0))
    assert np.median(bend) == pytest.approx(2 / 9.2, rel=0.1)


def test_laplacian_of_a_known_flow():
    x, y, z = offsets()
    liquid = liquid_of(np.linalg.norm([x, y, z], axis=0) - 10, np.stack([x**2, 0 * y, 3 * z]))
    cells = band_cells(liquid, inside=True)
    shaking = np.exp(break_measure(liquid, cells, 1.0, 0.0))
    np.testing.assert_allclose(shaking, 2.0, rtol=1e-3)


def test_bands_lie_on_either_side():
    liquid = ball(10)
    radius = np.linalg.norm(offsets(), axis=0)
    for inside, low, high in ((True, 8.4, 10), (False, 10, 11.6)):
        chosen = radius[tuple(band_cells(liquid, inside).T)]
        assert chosen.min() > low - 0.2 and chosen.max() < high + 0.2


def test_choice_takes_the_greatest_and_one_in_each_stratum():
    rng = np.random.default_rng(0)
    cells = np.argwhere(np.ones((20, 20, 20)))
    measure = cells[:, 0].astype(np.float32)
    points = choose(cells, measure, 0.25, 4.0, rng)
    assert points[:, 0].min() >= 15
    assert len(points) == 2 * 5 * 5  # x from 15 to 19 meets two layers of strata
    assert len(np.unique(np.floor(points / 4), axis=0)) == len(points)
    assert len(choose(cells, measure, 0.0, 4.0, rng)) == 0


def test_drops_come_from_the_rim():
    liquid = sheet()
    detail = add_droplets(liquid, DROPS)
    changed = np.argwhere(detail.liquid.level < liquid.level - 0.3)
    x, z = changed[:, 0] - 23.5, changed[:, 2] - 23.5
    rim = np.minimum(14 - np.abs(x), 10 - np.abs(z + 6))
    assert len(changed) > 20
    assert np.mean(rim < 4) > 0.8
    assert detail.gained > 0


def test_free_drops_are_ahead_of_the_flow_and_round():
    liquid = sheet(speed=2.0)
    cloud = add_droplets(liquid, DropletSettings(amount=0.05, cohesion=1.0)).cloud
    assert len(cloud.radii) > 3
    assert cloud.positions[:, 2].mean() > 0.0, "the sheet's middle is below"
    np.testing.assert_allclose(cloud.velocities[:, 2].mean(), 2.0, rtol=0.4)
    assert cloud.radii.max() < 6 * GRID.spacing
    mesh = cloud.mesh
    assert (edge_uses(mesh) == 2).all() and signed_volume(mesh) > 0
    meshed = 4 / 3 * np.pi * (cloud.radii[cloud.meshed].astype(float) ** 3).sum()
    assert signed_volume(mesh) == pytest.approx(meshed, rel=0.2)


def test_volume_that_droplets_add_is_reported():
    liquid = sheet()
    detail = add_droplets(liquid, DropletSettings(amount=0.005, size=1.0))
    mesh = level_surface(detail.liquid.level, liquid.velocity, GRID).joined(detail.cloud.mesh)
    before = signed_volume(level_surface(liquid.level, liquid.velocity, GRID))
    gained = (signed_volume(mesh) - before) / GRID.spacing**3
    assert detail.gained == pytest.approx(gained, rel=0.3)
    assert 0 < detail.gained < 0.3 * liquid.volume


def test_longer_flight_is_farther():
    near, far = (
        add_droplets(sheet(), DropletSettings(amount=0.03, flight=seconds)).cloud
        for seconds in (0.0167, 0.035)
    )
    assert far.positions[:, 2].max() > near.positions[:, 2].max() + 0.01


def test_seed_amount_and_limits_of_droplets():
    liquid = sheet()
    one, same, other = (
        add_droplets(liquid, DropletSettings(amount=0.03, seed=seed)) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one.liquid.level, same.liquid.level)
    np.testing.assert_array_equal(one.cloud.positions, same.cloud.positions)
    assert not np.array_equal(one.liquid.level, other.liquid.level)
    none = add_droplets(liquid, DropletSettings(amount=0.0))
    assert none.liquid is liquid and none.gained == 0
    full = add_droplets(liquid, DropletSettings(amount=1.0, particles=1000))
    assert "Most Particles" in full.warnings[0]
    assert np.isfinite(full.liquid.level).all()


def test_ruptures_only_take_liquid_and_take_it_at_the_front():
    liquid = sheet()
    detail = add_ruptures(liquid, RuptureSettings(amount=0.2))
    assert (detail.liquid.level >= liquid.level - 1e-6).all()
    lost = np.argwhere((liquid.level < 0) & (detail.liquid.level >= 0))
    assert len(lost) > 20
    assert lost[:, 2].mean() > np.argwhere(liquid.level < 0)[:, 2].mean() + 2, "it rises"
    assert detail.gained == pytest.approx(detail.liquid.volume - liquid.volume)
    assert -0.5 * liquid.volume < detail.gained < 0


def test_deeper_ruptures_take_more():
    shallow, deep = (
        add_ruptures(sheet(), RuptureSettings(amount=0.1, depth=depth)).gained
        for depth in (0.004, 0.03)
    )
    assert deep < 1.5 * shallow < 0


def test_specks_go_and_the_rest_stays():
    x, y, z = offsets()
    big = np.linalg.norm([x, y, z], axis=0) - 8
    speck = np.linalg.norm([x - 16, y, z], axis=0) - 1.6
    liquid = liquid_of(np.minimum(big, speck), np.zeros(3))
    detail = remove_specks(liquid, CleanupSettings(volume=40))
    assert label(detail.liquid.level < 0)[1] == 1
    np.testing.assert_array_equal(detail.liquid.level[x < 12], liquid.level[x < 12])
    assert remove_specks(liquid, CleanupSettings(volume=5)).gained == 0
    everything = remove_specks(liquid, CleanupSettings(volume=10_000))
    assert "Least Volume" in everything.warnings[0]


@pytest.fixture(scope="module")
def refiner() -> Refiner:
    return Refiner(sheet().fields())


def test_an_empty_list_is_the_plain_surface(refiner):
    plain = refiner.refine([])
    base = refiner.base.liquid
    expected = level_surface(base.level, base.velocity, base.grid)
    np.testing.assert_array_equal(plain.mesh.vertices, expected.vertices)
    assert plain.gained == [] and plain.warnings == []


def test_fields_of_a_liquid_have_its_surface():
    liquid = sheet()
    again = Refiner(liquid.fields()).base.liquid
    near = np.abs(liquid.level) < 2
    np.testing.assert_allclose(again.level[near], liquid.level[near], atol=1e-3)


@pytest.mark.parametrize("name", list(PRESETS))
def test_presets_give_closed_meshes(refiner, name):
    refined = refiner.refine(PRESETS[name].steps)
    assert (edge_uses(refined.mesh) == 2).all()
    assert signed_volume(refined.mesh) > 0
    assert len(refined.gained) == len(PRESETS[name].steps)
    assert np.isfinite(refined.mesh.vertices).all()
    assert len(refined.mesh.velocities) == len(refined.mesh.vertices)


def test_what_was_kept_changes_nothing(refiner):
    steps = [RuptureSettings(), DROPS, WaveSettings()]
    refiner.refine(steps)
    refiner.refine([RuptureSettings(), DropletSettings(seed=5)])
    warm = refiner.refine(steps)
    cold = Refiner(sheet().fields()).refine(steps)
    np.testing.assert_array_equal(warm.mesh.vertices, cold.mesh.vertices)


def test_steps_follow_the_seed_of_their_splash():
    fields, steps = sheet().fields(), (DROPS, SheetSettings(), WaveSettings())

    def refined(seed, *own):
        return Refiner(fields, seed=seed).refine(own or steps)

    plain, other = refined(0), refined(3)
    assert plain.cloud.positions.shape != other.cloud.positions.shape
    again = refined(3)
    np.testing.assert_array_equal(again.mesh.vertices, other.mesh.vertices)
    np.testing.assert_array_equal(
        Refiner(fields).refine(steps).mesh.vertices, plain.mesh.vertices, "as without a seed"
    )
    own = refined(3, replace(DROPS, seed=1))
    assert own.cloud.positions.shape != refined(3, DROPS).cloud.positions.shape
    applied = Refiner(fields, seed=3).applied(steps)
    kept = Refiner(fields, applied=applied, seed=3).refine(())
    np.testing.assert_array_equal(kept.mesh.vertices, other.mesh.vertices, "applied: as seen")


def test_no_two_seeds_of_splash_and_step_are_alike():
    seeds = {replace(DROPS, seed=b).of_splash(a).seed for a in range(40) for b in range(40)}
    assert len(seeds) == 1600
    assert DropletSettings(seed=5).of_splash(2**31 - 1).seed >= 0, "within its limits"
    assert WaveSettings().of_splash(3) == WaveSettings()


def test_waves_come_last_wherever_they_stand(refiner):
    first = refiner.refine([WaveSettings(), DROPS])
    last = refiner.refine([DROPS, WaveSettings()])
    np.testing.assert_array_equal(first.mesh.vertices, last.mesh.vertices)


def test_sheets_come_after_liquid_and_before_waves(refiner):
    steps = [DROPS, SheetSettings(), WaveSettings()]
    first, last = refiner.refine(steps), refiner.refine(steps[::-1])
    np.testing.assert_array_equal(first.mesh.vertices, last.mesh.vertices)
    assert (edge_uses(first.mesh) == 2).all()
    assert len(first.gained) == 3
    assert signed_volume(first.mesh) < 0.7 * signed_volume(refiner.refine([DROPS]).mesh)
    twice = refiner.refine([SheetSettings(film=3.0), *steps])
    np.testing.assert_array_equal(twice.mesh.vertices, first.mesh.vertices)
    assert "Only the last Sheets" in "".join(twice.warnings)
    assert refiner.liquid(steps).gained == refiner.liquid([DROPS]).gained, "solvers get no films"


def test_nothing_left_is_an_empty_mesh(refiner):
    steps = [CleanupSettings(volume=10_000), DROPS, SheetSettings(), WaveSettings()]
    refined = refiner.refine(steps)
    assert "Least Volume" in refined.warnings[0]
    assert len(refined.mesh.faces) == 0


def test_every_kind_has_limits_that_hold():
    for kind in KINDS.values():
        with pytest.raises(ValueError, match="must be from"):
            kind(**{fields(kind)[0].name: -1e9})


def block(low, high) -> Obstacle:
    """Return a box as an obstacle; corners in cells from the grid's middle."""
    corners = np.array(list(itertools.product(*zip(low, high, strict=True)))) * GRID.spacing
    faces = [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ]  # fmt: skip
    return obstacle_from_mesh(corners, np.array(faces))


def test_a_refined_splash_stays_out_of_an_obstacle():
    low, high = np.array([-6, -8, 0]), np.array([6, 8, 20])
    steps = [DropletSettings(amount=0.02), SheetSettings(), WaveSettings(amplitude=0.003)]
    refined = Refiner(sheet().fields(), obstacles=[block(low, high)], offset=0.25).refine(steps)
    cells = refined.mesh.vertices / GRID.spacing
    depth = np.minimum(cells - low, high - cells).min(axis=1)
    assert depth.max() < 0.1
    assert (edge_uses(refined.mesh) == 2).all()
    free = Refiner(sheet().fields()).refine(steps)
    depth = np.minimum(
        free.mesh.vertices / GRID.spacing - low, high - free.mesh.vertices / GRID.spacing
    )
    assert depth.min(axis=1).max() > 1, "without it the liquid is there"


def test_an_obstacle_around_everything_is_an_error():
    refiner = Refiner(sheet().fields(), obstacles=[block([-23] * 3, [23] * 3)])
    with pytest.raises(ObstacleError, match="swallow the whole splash"):
        refiner.refine([])
