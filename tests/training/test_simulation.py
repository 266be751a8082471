# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes, obstacles and the motion of the liquid."""

from dataclasses import replace

import numpy as np
import pytest

from training.obstacles import SHAPES, Obstacle, collide, open_share
from training.scenes import GAP, fill, random_scene
from training.simulate import simulate
from training.stepping import WALL, World, advance, initial_liquid, step

COARSE = 32


def body(shape):
    """Return an obstacle of this shape, turned, in cells."""
    angle = 0.7
    axes = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    return Obstacle(shape, 5.0, 4.0, np.array([16.0, 17.0, 15.0]), axes)


@pytest.mark.parametrize("shape", SHAPES)
def test_obstacle_distances_have_slope_one_and_agree_with_the_shape(shape):
    obstacle = body(shape)
    points = np.random.default_rng(0).uniform(4, 28, (4000, 3))
    distance = obstacle.distance(points)
    step_size = 1e-5
    slopes = [
        (obstacle.distance(points + step_size * axis) - distance) / step_size for axis in np.eye(3)
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
    wall = Obstacle("cube", 10.0, 1.0, np.array([20.3, 15.0, 15.0]), np.eye(3))
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


@pytest.mark.parametrize("seed", range(12))
def test_the_streamlet_starts_just_before_the_obstacle(seed):
    scene = random_scene(seed, COARSE)
    particles = fill(scene, np.random.default_rng(0)) * scene.spacing
    nearest = scene.obstacle.distance(particles).min() / scene.spacing
    assert 0.5 < nearest < GAP + 1.5
    volume = len(particles) / 8 * scene.spacing**3
    assert volume == pytest.approx(np.pi * scene.radius**2 * scene.length, rel=0.1)


def test_scenes_are_reproducible_and_differ():
    assert random_scene(5).speed == random_scene(5).speed != random_scene(6).speed


def far_away(scene):
    """Return the scene with its obstacle out of reach."""
    return replace(scene, obstacle=replace(scene.obstacle, centre=np.full(3, -9.0)))


def test_free_flight_is_a_parabola():
    scene = far_away(random_scene(0, COARSE))
    world, liquid = World.of(scene), initial_liquid(scene)
    later = advance(liquid, world, 0.03)
    assert len(later.positions) == len(liquid.positions)
    travelled = (later.positions.mean(0) - liquid.positions.mean(0)) * scene.spacing
    expected = scene.direction * scene.speed * 0.03 - np.array([0, 0, 9.81]) * 0.03**2 / 2
    # Symplectic Euler falls half a step's gravity too far; the coarse cells make steps of 15 ms.
    assert travelled == pytest.approx(expected, abs=9.81 * 0.03 * 0.015 / 2 * 1.1)
    speed = later.velocities.mean(0) * scene.spacing
    expected = scene.direction * scene.speed - np.array([0, 0, 9.81]) * 0.03
    assert speed == pytest.approx(expected, abs=2e-3)


def test_liquid_stays_out_of_the_obstacle_and_slows_down():
    scene = random_scene(0, COARSE)
    world = World.of(scene)
    liquid = initial_liquid(scene)
    later = advance(liquid, world, 0.08)
    assert world.obstacle.distance(later.positions).min() > -0.1
    momentum = later.velocities.mean(0) @ scene.direction * scene.spacing
    free = scene.speed + 9.81 * 0.08 * -scene.direction[2]
    assert momentum < 0.9 * free
    assert np.isfinite(later.positions).all()


def test_liquid_that_reaches_the_wall_is_dropped_and_counted():
    scene = far_away(random_scene(0, COARSE))
    liquid = initial_liquid(scene)
    positions, velocities = liquid.positions.copy(), liquid.velocities.copy()
    positions[:10] = WALL + np.arange(10)[:, None] * 0.01 + 0.05
    velocities[:10] = -1000.0
    moved = replace(liquid, positions=positions, velocities=velocities)
    after = step(moved, World.of(scene), 1e-3)
    assert after.emitted - len(after.positions) == 10


def test_frames_differ_and_hold_velocity_where_the_liquid_is():
    scene = random_scene(0, COARSE)
    frames = list(simulate(scene))
    assert 2 <= len(frames) <= 12
    times = [frame.time for frame in frames]
    assert times == sorted(times) and times[0] >= 0.05
    for frame in frames:
        dense = frame.dense_velocity()
        inside = np.argwhere(frame.distance < 0) // 2
        assert np.linalg.norm(dense[tuple(inside.T)], axis=1).min() > 0
        speed = np.linalg.norm(dense[tuple(inside.T)], axis=1)
        assert 0.2 * scene.speed < np.median(speed) < 3 * scene.speed + 1
