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
    BAND,
    PARTICLE_RADIUS,
    deepen,
    particle_distance,
)


def centres(shape):
    """Return the centres of an array's cells."""
    return np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in shape), indexing="ij"), axis=-1)


def test_one_particle_is_a_ball():
    particle = np.array([[10.2, 9.7, 11.4]], np.float32)
    distance = particle_distance(particle, (2, 3, 4), (16, 14, 15))
    places = centres((16, 14, 15)) + np.array([2, 3, 4])
    exact = np.linalg.norm(places - particle[0], axis=-1)
    assert np.abs(distance - np.minimum(exact - PARTICLE_RADIUS, BAND)).max() < 1e-4


def test_a_ball_of_particles_has_a_balls_distance():
    shape, radius = (40, 40, 40), 12.0
    axis = np.arange(0, 40, 0.5) + 0.25
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.linalg.norm(points - 20, axis=1) < radius
    distance = particle_distance(points[inside].astype(np.float32), (0, 0, 0), shape)
    deepen(distance)
    # Particles fill the ball to within a quarter of a cell, and their own radius is added.
    exact = np.linalg.norm(centres(shape) - 20, axis=-1) - radius - PARTICLE_RADIUS + 0.25
    near = np.abs(exact) < BAND - 0.5
    error = distance - exact
    assert np.abs(error[near]).mean() < 0.2
    assert np.abs(error[near]).max() < 0.8
    assert distance.min() == -BAND


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
