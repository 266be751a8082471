# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes, bodies and the motion of the liquid."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from liquid_splash_addon.core.fluid.collision import collide, open_share
from liquid_splash_addon.core.fluid.particles import Particles
from liquid_splash_addon.core.fluid.step import OPEN_MARGIN, advance, step
from training.scenes.bodies import SHAPES, Body
from training.scenes.families import FAMILIES, START_GAP, random_scene
from training.scenes.scene import Streamlet
from training.simulation.simulate import simulate
from training.simulation.snapshot import take_frame

COARSE = 32


def body(shape):
    """Return a body of this shape, turned, in cells."""
    angle = 0.7
    axes = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    return Body(shape, 5.0, 4.0, np.array([16.0, 17.0, 15.0]), axes)


@pytest.mark.parametrize("shape", SHAPES)
def test_body_distances_have_slope_one_and_agree_with_the_shape(shape):
    solid = body(shape)
    points = np.random.default_rng(0).uniform(4, 28, (4000, 3))
    distance = solid.distance(points)
    step_size = 1e-5
    slopes = [
        (solid.distance(points + step_size * axis) - distance) / step_size for axis in np.eye(3)
    ]
    slope = np.linalg.norm(slopes, axis=0)
    assert np.median(np.abs(slope - 1)) < 1e-6
    volume = {
        "sphere": 4 / 3 * np.pi * 125,
        "cube": 1000,
        "cylinder": np.pi * 25 * 8,
        "cone": np.pi * 25 * 8 / 3,
    }[shape]
    assert (distance < 0).mean() * 24**3 == pytest.approx(volume, rel=0.15)


def test_open_share_of_a_wall_is_the_part_beside_it():
    wall = Body("cube", 10.0, 1.0, np.array([20.3, 15.0, 15.0]), np.eye(3))
    share = open_share(np.array([[8, 15, 15], [10, 15, 15], [11, 15, 15], [12, 15, 15]]), wall)
    assert share[:, 0].tolist() == [1, 1, 0, 0]  # faces at x = 8, 10, 11, 12; the wall at 10.3
    assert share[1, 1] == pytest.approx(0.3, abs=0.13)
    assert share[3].tolist() == [0, 0, 0]


def test_collision_pushes_out_and_lets_go():
    ball = body("sphere")
    positions = np.array([[17.0, 17.0, 15.0], [16.0, 17.0, 20.5]])
    velocities = np.array([[-2.0, 1.0, 0.0], [0.0, 0.0, 3.0]])
    collide(positions, velocities, ball)
    assert ball.distance(positions).min() > -1e-6
    assert velocities[0] == pytest.approx([0, 1, 0], abs=0.05)
    assert velocities[1].tolist() == [0, 0, 3]


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", range(8))
def test_the_liquid_starts_just_before_what_it_hits(family, seed):
    scene = random_scene(seed, COARSE, family)
    particles = scene.fill()
    places = particles.positions * scene.spacing
    volume = sum(np.pi * s.radius**2 * s.length for s in scene.streamlets)
    assert particles.volumes.sum() * scene.spacing**3 == pytest.approx(volume, rel=1e-4)
    assert 5 < len(places) / particles.volumes.sum() < 12  # particles a cell
    first = scene.streamlets[0]
    flying = places[first.contains(places, 0.1 * scene.spacing)]
    if family == "streamlet" or family == "streamlets":
        others = scene.obstacle.distance(flying)
    else:  # the other liquid
        rest = places[~first.contains(places, 0.1 * scene.spacing)]
        assert len(rest)
        others = cKDTree(rest).query(flying)[0]
    # The jets meet at an angle, between their sampled points.
    most = 4 if family == "jets" else 1.5
    assert 0.2 < others.min() / scene.spacing < START_GAP + most
    assert scene.obstacle.distance(places).min() > -0.1 * scene.spacing


def test_families_come_by_their_weights():
    drawn = [random_scene(seed, 16).family for seed in range(400)]
    for name, (_, weight) in FAMILIES.items():
        assert drawn.count(name) / 400 == pytest.approx(weight, abs=0.06)
    assert sum(weight for _, weight in FAMILIES.values()) == pytest.approx(1)


def test_scenes_are_reproducible_and_differ():
    assert random_scene(5).parameters() == random_scene(5).parameters()
    assert random_scene(5).parameters() != random_scene(6).parameters()


def test_seeding_is_even():
    """No cell inside the streamlet has many more particles than another."""
    streamlet = Streamlet(0.2, 0.05, 1.0, np.full(3, 0.4), np.array([0.6, 0, 0.8]))
    positions = streamlet.fill(0.005, np.random.default_rng(0)).positions
    deep = streamlet.contains((positions.astype(int) + 0.5) * 0.005, -0.005)
    _, counts = np.unique(positions[deep].astype(int), axis=0, return_counts=True)
    assert counts.mean() == pytest.approx(8, rel=0.03)
    assert counts.std() < 0.6 * np.sqrt(8)  # of chance


def test_liquid_stays_out_of_the_obstacle_and_slows_down():
    scene = random_scene(5, COARSE, "streamlet")
    world = scene.world()
    liquid = advance(scene.liquid(), world, scene.impact + 0.08).particles
    assert world.solid.distance(liquid.positions).min() > -0.1
    direction, speed = scene.streamlets[0].direction, scene.streamlets[0].speed
    momentum = np.average(liquid.velocities, axis=0, weights=liquid.volumes) @ direction
    free = speed + 9.81 * 0.08 * -direction[2]
    assert momentum * scene.spacing < 0.9 * free
    assert np.isfinite(liquid.positions).all()


def test_liquid_that_reaches_the_wall_is_dropped_and_counted():
    scene = random_scene(0, COARSE, "streamlet")
    liquid = scene.liquid()
    particles = liquid.particles
    particles.positions[:10] = OPEN_MARGIN + np.arange(10)[:, None] * 0.01 + 0.05
    particles.velocities[:10] = -1000.0
    particles.affine[:10] = 0.0
    after = step(liquid, scene.world(), 1e-3)
    assert after.left == pytest.approx(particles.volumes[:10].sum(), rel=1e-3)


def test_frames_differ_and_hold_velocity_where_the_liquid_is():
    scene = random_scene(0, COARSE, "streamlet")
    frames = list(simulate(scene))
    assert 2 <= len(frames) <= 16
    times = [frame.time for frame in frames]
    assert times == sorted(times) and times[0] >= 0.05
    speed = scene.streamlets[0].speed
    for frame in frames:
        dense = frame.block_velocity
        inside = np.argwhere(frame.distance < 0) // 2
        speeds = np.linalg.norm(dense[tuple(inside.T)], axis=1)
        assert speeds.min() > 0
        assert 0.2 * speed < np.median(speeds) < 3 * speed + 1


def test_frames_can_be_stored_coarser_than_they_were_simulated():
    scene = random_scene(0, COARSE, "streamlet")
    fine = next(simulate(scene))
    coarse = next(simulate(scene, stored_spacing=2 * scene.spacing))
    volumes = [(f.distance < 0).sum() * h**3 for f, h in ((fine, 1), (coarse, 2))]
    assert volumes[1] > volumes[0]  # thin parts are as thick as the grid can hold
    assert np.allclose(coarse.start * 2, fine.start, atol=16)
    medians = [
        np.median(f.block_velocity[f.block_velocity.any(-1)], axis=0) for f in (fine, coarse)
    ]
    assert np.linalg.norm(medians[0] - medians[1]) < 0.25 * np.linalg.norm(medians[0])


def test_spray_is_kept_as_droplets_not_as_occupancy():
    scene = random_scene(0, COARSE, "streamlet")
    world, liquid = scene.world(), scene.liquid()
    drop = Particles.moving(
        np.array([[50.2, 20.3, 20.4], [50.4, 20.3, 20.4]]), np.full(3, 8.0), 1 / 8
    )
    both = replace(liquid, particles=Particles.joined(liquid.particles, drop))
    plain = take_frame(liquid, world, scene.spacing, scene.spacing, 0.1)
    frame = take_frame(both, world, scene.spacing, scene.spacing, 0.1)
    assert len(plain.droplets) == 0 and len(frame.droplets) == 1
    assert (frame.distance < 0).sum() == (plain.distance < 0).sum()
    h = scene.spacing
    expected = [
        50.3 * h,
        20.3 * h,
        20.4 * h,
        8 * h,
        8 * h,
        8 * h,
        np.cbrt(0.25 * 3 / 4 / np.pi) * h,
    ]
    assert frame.droplets[0] == pytest.approx(expected, rel=2e-3)
