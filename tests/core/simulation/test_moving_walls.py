# SPDX-License-Identifier: GPL-3.0-or-later
"""Walls that move, and liquid that they push."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from liquid_splash_addon.core.fluid.particles import Particles
from liquid_splash_addon.core.fluid.step import Liquid, World, advance
from liquid_splash_addon.core.obstacles.obstacles import ObstacleError, depth_of_points
from liquid_splash_addon.core.obstacles.obstacles import obstacle_from_mesh as obstacle
from liquid_splash_addon.core.simulation.run import frame_of
from liquid_splash_addon.core.simulation.scene import prepare
from liquid_splash_addon.core.simulation.settings import SimulationSettings
from liquid_splash_addon.core.simulation.start import MovingObstacle
from tests.core.simulation import starts
from tests.core.solids import box, sphere

COARSE = SimulationSettings(resolution="64")


class Piston:
    """A channel of eight cells square along x, closed by a wall that moves along it."""

    def __init__(self, place: float, speed: float) -> None:
        self.place, self.speed = place, speed

    def distance(self, points: np.ndarray) -> np.ndarray:
        sides = 4.0 - np.abs(points[:, 1:] - 32.0).max(axis=1)
        return np.asarray(np.minimum(sides, points[:, 0] - self.place), dtype=float)

    def velocity(self, points: np.ndarray) -> np.ndarray:
        sides = 4.0 - np.abs(points[:, 1:] - 32.0).max(axis=1)
        out = np.zeros(points.shape)
        out[points[:, 0] - self.place < sides, 0] = self.speed
        return out


class MovingPiston:
    """The piston at every moment."""

    def __init__(self, place: float, speed: float) -> None:
        self.place, self.speed = place, speed

    def at(self, time: float) -> Piston:
        return Piston(self.place + self.speed * time, self.speed)

    def fastest(self, begin: float, end: float) -> float:
        return abs(self.speed)


def plug() -> Liquid:
    """Return liquid at rest in the channel, from 20 to 30 cells."""
    axes = [np.arange(low + 0.25, high, 0.5) for low, high in ((20, 30), (28, 36), (28, 36))]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Liquid.at_start(Particles.moving(points, np.zeros(3), 1 / 8))


@pytest.mark.parametrize("speed", [20.0, 200.0])
def test_a_wall_pushes_liquid_at_its_own_speed(speed):
    begun, world = plug(), World(64, 0.0, 0.0, MovingPiston(20.0, speed))
    later = advance(begun, world, 8 / speed)
    assert later.left == 0
    moved = later.particles.positions[:, 0].mean() - begun.particles.positions[:, 0].mean()
    # Crowded particles at the wall spread a little, and there is only one way out.
    assert moved == pytest.approx(8.0, abs=0.8)
    assert np.median(later.particles.velocities[:, 0]) == pytest.approx(speed, rel=0.02)
    assert later.particles.positions[:, 0].min() > 28.0


def test_a_wall_that_could_move_but_rests_is_like_any_other_bit_for_bit():
    fallen = [
        advance(plug(), World(64, 800.0, 0.0, solid), 0.02).particles
        for solid in (Piston(20.0, 0.0), MovingPiston(20.0, 0.0))
    ]
    for one, other in zip(*fallen, strict=True):
        assert np.array_equal(one, other)


def test_a_wall_that_withdraws_does_not_pull():
    world = World(64, 0.0, 0.0, MovingPiston(20.0, -50.0))
    later = advance(plug(), world, 0.1)
    assert np.abs(later.particles.velocities).max() < 1.0
    assert later.particles.positions[:, 0].min() > 19.5


def test_an_obstacle_between_two_poses_lies_and_moves_between_them():
    vertices, faces = sphere(0.04, rings=24)
    way = np.array([0.01, -0.02, 0.005])
    mover = starts.moving(vertices, faces, way, 3)
    begun = starts.start(starts.ball(0.03, (0.1, 0.1, 0.1)), obstacles=(mover,))
    scene = prepare(begun, replace(COARSE, margin=4.0))
    time = 1.3 * begun.frame_seconds
    solid = scene.world.solid_at(time)
    rng = np.random.default_rng(0)
    points = rng.normal(size=(500, 3))
    points *= (rng.uniform(0.03, 0.05, 500) / np.linalg.norm(points, axis=1))[:, None]
    places = scene.domain.to_cells(points + 1.3 * way)
    known = (np.linalg.norm(points, axis=1) - 0.04) / scene.domain.cell
    assert solid.distance(places) == pytest.approx(known, abs=0.15)
    speed = scene.domain.vectors_to_cells(way / begun.frame_seconds)
    assert solid.velocity(places) == pytest.approx(np.tile(speed, (500, 1)), abs=1e-3)
    assert scene.world.fastest_wall(0, time) == pytest.approx(np.linalg.norm(speed), rel=1e-5)
    after = scene.world.solid_at(10 * begun.frame_seconds)
    assert not after.velocity(scene.domain.to_cells(points + 3 * way)).any()


def test_a_turning_obstacle_has_the_speed_of_its_surface():
    vertices, faces = box((-0.05, -0.05, -0.02), (0.05, 0.05, 0.02))
    angle = 0.05

    def turned(times):
        c, s = np.cos(times * angle), np.sin(times * angle)
        return vertices @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])

    poses = np.stack([turned(times) for times in range(3)]).astype(np.float32)
    begun = starts.start(
        starts.ball(0.02, (0, 0, 0.1)), obstacles=(MovingObstacle(poses, faces, "Turner"),)
    )
    scene = prepare(begun, COARSE)
    points = np.array([[0.04, 0.01, 0.021], [0.051, 0.03, 0], [0, 0, 0.021]])
    speed = scene.world.solid_at(0.5 * begun.frame_seconds).velocity(scene.domain.to_cells(points))
    rate = angle / begun.frame_seconds
    known = rate * np.stack([-points[:, 1], points[:, 0], 0 * points[:, 0]], axis=1)
    found = scene.domain.vectors_to_local(speed)
    assert found == pytest.approx(known, abs=0.05 * rate * 0.05)


@pytest.mark.parametrize("way", [(0, 0, 0), (0.004, 0, 0.001)], ids=["still", "moving"])
def test_obstacles_are_never_entered(way):
    vertices, faces = sphere(0.05, (-0.02, 0.01, 0), rings=32)
    mover = starts.moving(vertices, faces, way, 10)
    liquid = starts.ball(0.05, (0.09, 0, 0.03), speed=(-2.5, 0, -0.5))
    begun = starts.start(liquid, obstacles=(mover,), ground=-0.06)
    scene = prepare(begun, replace(COARSE, ground="FLOOR", margin=2.0))
    state = scene.liquid
    for frame in range(1, 9):
        state = advance(state, scene.world, frame * begun.frame_seconds)
        seen = frame_of(state, scene)
        pose = vertices + frame * np.asarray(way)
        points = np.concatenate(
            [seen.mesh.vertices, scene.domain.to_local(state.particles.positions.astype(float))]
        )
        depth, _ = depth_of_points(obstacle(pose, faces), points, scene.domain.cell, 3.0)
        assert depth.min() > -0.2
        assert points[:, 2].min() > -0.06 - 0.2 * scene.domain.cell
    assert state.left == pytest.approx(0, abs=1e-3 * state.emitted)


def test_bad_obstacles_are_named():
    vertices, faces = box((-1, -1, -1), (1, 1, 1))
    wrong = vertices.copy()
    wrong[0] = np.nan
    for bad in (
        MovingObstacle(wrong[None].astype(np.float32), faces, "Bad"),
        MovingObstacle(vertices[None].astype(np.float32), faces[:0], "Bad"),
    ):
        with pytest.raises(ObstacleError, match="'Bad'"):
            prepare(starts.start(starts.ball(), obstacles=(bad,)), COARSE)
