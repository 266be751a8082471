# SPDX-License-Identifier: GPL-3.0-or-later
"""No slider blows up what it changes, and what is gained is reported and bounded.

Waves: test_waves.py.
"""

import itertools
from dataclasses import fields

import numpy as np
import pytest

from liquid_splash_addon.core.refinement import ruptures
from liquid_splash_addon.core.refinement.cleanup import remove_specks
from liquid_splash_addon.core.refinement.droplets import add_droplets, make_particles, sample_points
from liquid_splash_addon.core.refinement.particle_level import FineLevel
from liquid_splash_addon.core.refinement.ruptures import add_ruptures
from liquid_splash_addon.core.refinement.settings import (
    SMALLEST_RADIUS,
    CleanupSettings,
    DropletSettings,
    RuptureSettings,
    WaveSettings,
)
from liquid_splash_addon.core.refinement.stack import Refiner
from tests.core.refinement.shapes import GRID, sheet
from tests.core.refinement.test_particles import drop

LIQUID = sheet()


def ends(kind) -> list:
    """Return settings with each slider alone at either end, and with all of them there."""
    sliders = {item.name: (item.metadata["low"], item.metadata["high"]) for item in fields(kind)}
    alone = [{name: end} for name, both in sliders.items() for end in both]
    together = [{name: both[end] for name, both in sliders.items()} for end in (0, 1)]
    return [kind(**values) for values in (*alone, *together)]


# Where drops fly apart, run into each other, or are of all sizes.
CORNERS = [
    DropletSettings(amount=amount, size=size, spread=spread, flight=0.1, cohesion=cohesion)
    for amount, size, spread, cohesion in itertools.product(
        (0.02, 1.0), (0.3, 3.0), (0.0, 1.0), (0.0, 1.0)
    )
    if (amount, size) != (1.0, 0.3)
]


def volume_made(settings: DropletSettings) -> float:
    """Return the volume that the particles of droplets stand for, cells."""
    rng = np.random.default_rng(settings.seed)
    points = sample_points(LIQUID, settings, rng)
    if not len(points):
        return 0.0
    drops, _ = make_particles(LIQUID, points, settings, rng)
    return float((drops.spacing.astype(np.float64) ** 3).sum())


def is_sound(detail) -> bool:
    liquid = detail.liquid
    fastest = 2 * np.linalg.norm(LIQUID.velocity, axis=0).max()
    arrays = (liquid.level, liquid.velocity, detail.cloud.positions, detail.cloud.mesh.vertices)
    return (
        all(np.isfinite(array).all() for array in arrays)
        and np.abs(liquid.velocity).max() <= fastest
        and np.abs(detail.cloud.velocities).max(initial=0) <= fastest
    )


@pytest.mark.parametrize("settings", [*ends(DropletSettings), *CORNERS], ids=str)
def test_droplets_at_the_ends_of_their_sliders(settings):
    detail = add_droplets(LIQUID, settings)
    assert is_sound(detail)
    # Liquid about to fly apart, which nothing holds together, is swollen by half: its particles
    # leave room between them, not yet enough to tell them from a drop.
    assert -1e-6 <= detail.gained < 1.6 * volume_made(settings) + 1e-6
    reach = settings.flight * 2 * np.linalg.norm(LIQUID.velocity, axis=0).max() / GRID.spacing
    assert np.abs(detail.cloud.positions).max(initial=0) / GRID.spacing < 20 + reach


@pytest.mark.parametrize("settings", ends(RuptureSettings), ids=str)
def test_ruptures_at_the_ends_of_their_sliders(settings):
    detail = add_ruptures(LIQUID, settings)
    assert is_sound(detail)
    assert -LIQUID.volume <= detail.gained <= 0


@pytest.mark.parametrize("settings", ends(CleanupSettings), ids=str)
def test_cleanup_at_the_ends_of_its_slider(settings):
    detail = remove_specks(LIQUID, settings)
    assert is_sound(detail)
    assert -LIQUID.volume <= detail.gained <= 0


def test_what_the_defaults_gain_is_reported_and_small():
    steps = [DropletSettings(), RuptureSettings(), CleanupSettings(), WaveSettings()]
    for step, most in zip(steps, (0.05, 0.1, 0.0, 0.02), strict=True):
        gained = Refiner(LIQUID.fields()).refine([step]).gained
        assert len(gained) == 1 and abs(gained[0]) <= most


def test_fewer_particles_than_a_drop_needs_make_none():
    detail = add_droplets(LIQUID, DropletSettings(particles=100))
    assert detail.liquid is LIQUID and not len(detail.cloud.radii)
    assert "Most Particles" in detail.warnings[0]


@pytest.mark.parametrize("apart", [2.0, 3.0, 5.0])
def test_particles_that_flew_apart_do_not_fill_the_space_between(apart):
    drops = drop(radius=3.0, count=400)
    spray = drops._replace(positions=20 + np.float32(apart) * (drops.positions - 20))
    volume = np.clip(0.5 - FineLevel.of(spray).level, 0, 1).sum() / 8
    assert volume < 2 * (drops.spacing.astype(np.float64) ** 3).sum()


def test_small_drops_are_points_only():
    cloud = add_droplets(LIQUID, DropletSettings(amount=0.03, flight=0.03, cohesion=0.2)).cloud
    cells = cloud.radii / GRID.spacing
    np.testing.assert_array_equal(cloud.meshed, cells >= SMALLEST_RADIUS)
    assert 0 < cloud.meshed.sum() < len(cells)
    assert set(cloud.owner) == set(np.flatnonzero(cloud.meshed))


def test_more_air_than_memory_allows_is_left_out_with_a_warning(monkeypatch):
    settings = RuptureSettings(amount=1.0)
    whole = add_ruptures(LIQUID, settings)
    assert not whole.warnings
    monkeypatch.setattr(ruptures, "MOST_AIR", 5_000)
    sizes = []
    thinned = ruptures.thinned
    monkeypatch.setattr(ruptures, "thinned", lambda a: sizes.append(len(a.spacing)) or thinned(a))
    part = add_ruptures(LIQUID, settings)
    assert 0 < sizes[0] <= 5_000
    assert "lower Amount" in part.warnings[0]
    assert whole.gained < part.gained < 0
