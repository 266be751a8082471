# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated splashes against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from liquid_splash_addon.core.fluid.step import advance
from liquid_splash_addon.core.mesh.closest_point import nearest_on_mesh
from liquid_splash_addon.core.mesh.marching_cubes import level_surface
from liquid_splash_addon.core.simulation.domain import upright
from liquid_splash_addon.core.simulation.estimate import estimate
from liquid_splash_addon.core.simulation.run import frame_of
from liquid_splash_addon.core.simulation.scene import prepare
from liquid_splash_addon.core.simulation.settings import SimulationSettings
from liquid_splash_addon.core.simulation.start import LooseDrops
from tests.core.simulation import starts
from tests.core.solids import is_closed, volume

COARSE = SimulationSettings(resolution="64")


def centre(liquid, scene):
    """Return the centre of mass, local metres."""
    particles = liquid.particles
    middle = np.average(particles.positions.astype(float), axis=0, weights=particles.volumes)
    return scene.domain.to_local(middle)


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 1, 0), (0.48, -0.6, 0.64)])
def test_without_obstacles_the_centre_of_mass_flies_a_parabola(up):
    speed, up = np.array([0.6, -0.4, 0.9]), np.array(up, dtype=float)
    begun = starts.start(starts.ball(speed=speed), up=up)
    scene = prepare(begun, replace(COARSE, margin=1.0))
    seconds = 0.1
    flown = centre(advance(scene.liquid, scene.world, seconds), scene) - centre(scene.liquid, scene)
    path = speed * seconds - 0.5 * 9.81 * up * seconds**2
    assert np.linalg.norm(flown - path) < 0.01 * np.linalg.norm(path)


def test_without_gravity_it_flies_straight():
    begun = starts.start(starts.ball(speed=(0.0, 0.0, 1.0)))
    scene = prepare(begun, replace(COARSE, gravity=False))
    flown = centre(advance(scene.liquid, scene.world, 0.05), scene) - centre(scene.liquid, scene)
    assert flown == pytest.approx([0, 0, 0.05], abs=5e-4)


def test_with_velocity_the_crown_rises_and_spreads_and_without_it_collapses():
    def look(speed):
        begun = starts.start(starts.crown(speed), ground=-0.07)
        scene = prepare(begun, replace(COARSE, ground="FLOOR", margin=1.0))
        later = advance(scene.liquid, scene.world, 0.08)
        sizes = []
        for liquid in (scene.liquid, later):
            points = scene.domain.to_local(liquid.particles.positions.astype(float))
            sizes.append((points[:, 2].mean(), np.hypot(points[:, 0], points[:, 1]).mean()))
        (height, radius), (after, wider) = sizes
        return after - height, wider - radius

    up, out = look(2.0)
    assert up > 0.03 and out > 0.03
    down, still = look(0.0)
    assert down < -0.01 and abs(still) < 0.3 * out


@pytest.mark.parametrize("liquid", [starts.ball(0.06), starts.crown(1.0)], ids=["ball", "crown"])
def test_the_first_frame_is_the_static_splash(liquid):
    begun = starts.start(liquid, up=np.array([0.3, 0.1, 0.9]))
    scene = prepare(begun, replace(COARSE, resolution="64"))
    frame = frame_of(scene.liquid, scene)
    static = level_surface(liquid.level, liquid.velocity, liquid.grid)
    for one, other in ((frame.mesh, static), (static, frame.mesh)):
        triangles = other.vertices[other.faces].astype(np.float64)
        apart, _, _ = nearest_on_mesh(triangles, one.vertices.astype(np.float64), 0.05)
        assert apart.mean() < 0.25 * scene.domain.cell
    assert not len(frame.drops.radii) and frame.left == 0
    assert is_closed(frame.mesh.faces)
    own, known = volume(frame.mesh.vertices, frame.mesh.faces), liquid.volume * 1e-6
    assert own == pytest.approx(known, rel=0.08)


def test_a_frame_has_the_liquids_velocity_in_local_axes():
    begun = starts.start(starts.ball(speed=(0.3, -0.7, 0.2)), up=np.array([1.0, 0.5, 0.2]))
    scene = prepare(begun, COARSE)
    found = frame_of(scene.liquid, scene).mesh.velocities
    assert found == pytest.approx(np.tile([0.3, -0.7, 0.2], (len(found), 1)), abs=1e-3)


def test_a_still_pool_stays_still_and_keeps_its_volume():
    begun = starts.start(starts.ball(0.02, (0, 0, 0.1)), ground=0.0)
    settings = replace(COARSE, ground="POOL", margin=1.0, pool_depth=0.04)
    scene = prepare(begun, settings)
    particles = scene.liquid.particles
    ours = particles.positions[:, 2] < np.round(-scene.domain.corner[2] / scene.domain.cell) + 0.1
    assert ours.sum() > 1000
    later = advance(scene.liquid, scene.world, 0.03)  # the ball has not come down yet
    assert later.left == 0
    low = later.particles.positions[:, 2] < particles.positions[ours, 2].max() + 0.5
    mesh = frame_of(later, scene).mesh
    pool = mesh.vertices[:, 2] < 0.02
    assert pool.sum() > 300
    assert np.quantile(np.linalg.norm(mesh.velocities[pool], axis=1), 0.99) < 0.02
    top = np.quantile(later.particles.positions[low, 2], 0.999)
    assert top == pytest.approx(particles.positions[ours, 2].max(), abs=0.25)


def test_drops_keep_their_place_speed_and_size():
    places = np.array([[0.1, 0, 0], [-0.1, 0, 0.05]], dtype=np.float32)
    drops = LooseDrops(
        places, np.array([[0, 0, 1], [0, 1, 0]], np.float32), np.array([0.002, 0.004], np.float32)
    )
    begun = starts.start(starts.ball(0.03), drops=drops)
    scene = prepare(begun, COARSE)
    found = frame_of(scene.liquid, scene).drops
    order = np.argsort(-found.positions[:, 0])
    assert found.positions[order] == pytest.approx(places, abs=2e-4)
    assert found.radii[order] == pytest.approx(drops.radii, rel=1e-3)
    assert found.velocities[order] == pytest.approx(drops.velocities, abs=1e-4)


def test_what_leaves_the_domain_is_counted():
    begun = starts.start(starts.ball(speed=(5.0, 0, 0)))
    scene = prepare(begun, replace(COARSE, margin=0.1))
    later = advance(scene.liquid, scene.world, 0.2)
    assert frame_of(later, scene).left > 0.99
    earlier = advance(scene.liquid, scene.world, 0.001)
    assert frame_of(earlier, scene).left == pytest.approx(0, abs=1e-6)


def test_the_estimate_knows_the_particles_and_grows_with_the_resolution():
    begun = starts.start(starts.ball())
    coarse = estimate(begun, COARSE)
    scene = prepare(begun, COARSE)
    assert coarse.particles == pytest.approx(len(scene.liquid.particles.positions), rel=0.1)
    fine = estimate(begun, replace(COARSE, resolution="128"))
    assert fine.particles == pytest.approx(8 * coarse.particles, rel=0.01)
    assert fine.memory > coarse.memory and fine.disc > 7 * coarse.disc
    assert fine.seconds > 7 * coarse.seconds


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 0, -2), (1, 1, 1), (1e-3, 0, 1)])
def test_the_domain_stands_upright(up):
    axes = upright(np.array(up, dtype=float))
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1)
    assert axes[2] == pytest.approx(np.array(up) / np.linalg.norm(up))


def test_bad_starts_get_a_sentence():
    empty = starts.liquid(lambda points: np.ones(points.shape[:-1]), lambda points: np.zeros(3))
    with pytest.raises(ValueError, match="no liquid"):
        prepare(starts.start(empty), COARSE)
    with pytest.raises(ValueError, match="rotation"):
        prepare(starts.start(starts.ball(), up=np.zeros(3)), COARSE)
    far = starts.start(starts.ball(), ground=-50.0)
    with pytest.raises(ValueError, match="move the ground nearer"):
        prepare(far, replace(COARSE, ground="FLOOR"))
    sunk = starts.start(starts.ball(), ground=0.2)
    with pytest.raises(ValueError, match="No liquid is left"):
        prepare(sunk, replace(COARSE, ground="FLOOR"))
