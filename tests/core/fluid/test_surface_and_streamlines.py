# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances of particles, and lines traced in known flows."""

import numpy as np
import pytest

from liquid_splash_addon.core.fluid.streamlines import (
    hausdorff,
    representatives,
    seed_points,
    trace,
)
from liquid_splash_addon.core.fluid.surface import (
    DISTANCE_BAND,
    PARTICLE_RADIUS,
    particle_distance,
    redistance,
)


def centres(shape):
    """Return the centres of an array's cells."""
    return np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in shape), indexing="ij"), axis=-1)


def lattice(low, high):
    """Return 8 particles a cell between two corners, and their volumes."""
    axes = [np.arange(a, b, 0.5) + 0.25 for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return points.astype(np.float32), np.full(len(points), 1 / 8, np.float32)


def test_one_particle_is_a_ball():
    particle = np.array([[10.2, 9.7, 11.4]], np.float32)
    distance = particle_distance(
        particle, np.ones(1, np.float32), np.array([2, 3, 4]), (16, 14, 15)
    )
    places = centres((16, 14, 15)) + np.array([2, 3, 4])
    exact = np.minimum(
        np.linalg.norm(places - particle[0], axis=-1) - PARTICLE_RADIUS, DISTANCE_BAND
    )
    assert np.abs(distance - exact).max() < 0.6
    assert np.abs(distance - exact).mean() < 0.08
    assert np.array_equal(distance < 0, exact < 0)


def test_a_ball_of_particles_has_a_balls_distance():
    shape, radius = (40, 40, 40), 12.0
    points, volumes = lattice((0, 0, 0), shape)
    inside = np.linalg.norm(points - 20, axis=1) < radius
    distance = particle_distance(points[inside], volumes[inside], np.zeros(3, int), shape)
    exact = np.linalg.norm(centres(shape) - 20, axis=-1) - radius - 0.4
    near = np.abs(exact) < DISTANCE_BAND - 0.5
    assert np.abs((distance - exact)[near]).mean() < 0.15
    assert np.abs((distance - exact)[near]).max() < 0.6
    assert distance.min() == -DISTANCE_BAND and distance.max() == DISTANCE_BAND


def test_a_sheet_of_one_layer_is_as_thick_as_a_grid_can_hold():
    points, volumes = lattice((0, 0, 10), (24, 24, 10.5))
    distance = particle_distance(points, volumes, np.zeros(3, int), (24, 24, 20))
    middle = distance[6:-6, 6:-6]
    heights = np.arange(20) + 0.5
    exact = np.abs(heights - 10.25) - PARTICLE_RADIUS
    near = np.abs(exact) < 2
    assert np.abs(middle[..., near] - exact[near]).max() < 0.2


def test_redistancing_gives_gradient_one_and_keeps_the_surface():
    shape = (40, 40, 40)
    exact = np.linalg.norm(centres(shape) - 20, axis=-1) - 9.3
    level = (exact * (1.5 + np.sin(centres(shape)[..., 0]))).astype(np.float32)
    distance = redistance(level)
    assert np.array_equal(distance < 0, level < 0)
    near = np.abs(exact) < 2.5
    assert np.abs((distance - exact)[near]).mean() < 0.12


def ring_flow(shape=(32, 32, 32)):
    """Return a slab of liquid that rotates about its middle, velocity on cells of 2^3."""
    distance = (np.abs(centres(shape)[..., 2] - 16) - 5).astype(np.float32)
    places = centres([n // 2 for n in shape]) * 2 - 16
    velocity = np.stack([-places[..., 1], places[..., 0], 1e-6 + 0 * places[..., 0]], axis=-1)
    return distance, velocity.astype(np.float32)


def test_a_line_in_a_rotation_is_a_circle_and_ends_where_it_closes():
    distance, velocity = ring_flow()
    seed = np.array([[24.0, 16.0, 16.0]])
    (line,) = trace(distance, velocity, seed, np.array([200.0]))
    radius = np.linalg.norm(line[:, :2] - 16, axis=1)
    assert np.abs(radius - 8).max() < 0.05
    assert len(line) * 0.5 == pytest.approx(2 * np.pi * 8, abs=2.5)
    assert np.abs(np.linalg.norm(line[:, 3:], axis=1) - 8).max() < 0.1


def test_a_line_ends_at_its_length_and_on_leaving_the_liquid():
    distance, velocity = ring_flow()
    seed = np.array([[24.0, 16.0, 16.0]])
    (line,) = trace(distance, velocity, seed, np.array([10.0]))
    assert (len(line) - 1) * 0.5 == pytest.approx(10.0, abs=0.5)
    up = np.zeros_like(velocity) + np.float32([0, 0, 1])
    (line,) = trace(distance, up, seed, np.array([100.0]))
    assert line[-1, 2] == pytest.approx(21.5, abs=0.6)
    assert trace(distance, up, np.array([[24.0, 16.0, 19.0]]), np.array([100.0])) == []


def test_a_line_traced_both_ways_passes_through_its_seed_in_flow_direction():
    distance, velocity = ring_flow()
    seed = np.array([[24.0, 16.0, 16.0]])
    (line,) = trace(distance, velocity, seed, np.array([10.0]), both_ways=True)
    assert (len(line) - 1) * 0.5 == pytest.approx(20.0, abs=1.0)
    middle = line[len(line) // 2]
    assert np.abs(middle[:3] - seed[0]).max() < 0.6
    steps = np.diff(line[:, :3], axis=0)
    assert (np.linalg.norm(steps, axis=1) < 0.6).all()
    assert ((steps * line[:-1, 3:]).sum(axis=1) > 0).all()


def test_a_ring_traced_both_ways_is_drawn_once():
    distance, velocity = ring_flow()
    seed = np.array([[24.0, 16.0, 16.0]])
    (line,) = trace(distance, velocity, seed, np.array([200.0]), both_ways=True)
    assert len(line) * 0.5 == pytest.approx(2 * np.pi * 8, abs=2.5)


def test_seeds_lie_in_the_liquid_evenly():
    distance, _ = ring_flow()
    seeds = seed_points(distance, 400, np.random.default_rng(0))
    assert np.abs(seeds[:, 2] - 16).max() <= 5.5
    assert (seeds[:, 0] < 16).mean() == pytest.approx(0.5, abs=0.05)


def test_hausdorff_of_parallel_lines_is_their_distance():
    t = np.linspace(0, 10, 30)
    lines = [np.stack([t, 0 * t + y, 0 * t], axis=1) for y in (0.0, 3.0, 4.0)]
    assert hausdorff(lines) == pytest.approx([3.0, 4.0, 1.0], abs=1e-5)


def test_clusters_are_found_and_their_middle_is_taken():
    t = np.linspace(0, 10, 30)
    places = [0, 0.5, 1.0, 8.0, 8.4, 8.8, 20.0]
    lines = [np.stack([t, 0 * t + y, 0 * t], axis=1) for y in places]
    assert sorted(representatives(lines, 3)) == [1, 4, 6]
    assert representatives(lines, 9) == list(range(7))
