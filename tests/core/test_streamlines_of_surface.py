# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes out of a flow: their speed and course against flows that are known."""

import numpy as np
import pytest
from skimage.measure import marching_cubes

from liquid_splash_addon.core.animation.streamline_settings import StreamlineSettings
from liquid_splash_addon.core.animation.streamlines_of_surface import (
    FlowError,
    slowed,
    strokes_of_particles,
    strokes_of_surface,
)


def ring(radius=1.0, tube=0.25, size=48):
    """Return the surface of a torus about z."""
    x, y, z = np.meshgrid(*3 * [np.linspace(-1.5, 1.5, size)], indexing="ij")
    level = np.hypot(np.hypot(x, y) - radius, z) - tube
    vertices, faces, _, _ = marching_cubes(level, 0.0, spacing=3 * (3.0 / (size - 1),))
    return vertices - 1.5, faces


def turning(points, rate=2.0):
    """Return the velocity of a solid body that turns about z."""
    return rate * np.stack([-points[:, 1], points[:, 0], np.zeros(len(points))], axis=1)


def direction_and_speed_errors(drawing, flow):
    steps = np.diff(drawing.points, axis=0)
    middles = (drawing.points[1:] + drawing.points[:-1]) / 2
    speed = np.linalg.norm(steps, axis=1) / np.diff(drawing.times)
    wanted = flow(middles)
    size = np.linalg.norm(wanted, axis=1)
    cosine = (steps * wanted).sum(axis=1) / np.linalg.norm(steps, axis=1) / size
    return cosine, speed / size - 1


@pytest.mark.parametrize("rate", [2.0, 0.003])
def test_strokes_follow_a_turning_ring_at_its_speed(rate):
    vertices, faces = ring()
    drawings = strokes_of_surface(
        vertices, faces, turning(vertices, rate), StreamlineSettings(strokes=6)
    )
    assert 3 <= len(drawings) <= 6
    for drawing in drawings:
        cosine, error = direction_and_speed_errors(drawing, lambda p: turning(p, rate))
        assert np.median(cosine) > 0.99 and np.median(np.abs(error)) < 0.05
        apart = np.hypot(np.hypot(*drawing.points[:, :2].T) - 1, drawing.points[:, 2])
        assert apart.max() < 0.3


def test_particles_give_the_same_strokes_as_the_surface():
    rng = np.random.default_rng(0)
    angle, away, around = rng.uniform(0, 2 * np.pi, (3, 8000))
    tube = 0.25 * np.sqrt(away / (2 * np.pi))
    radius = 1 + tube * np.cos(around)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), tube * np.sin(around)], 1)
    drawings = strokes_of_particles(points, turning(points), StreamlineSettings(strokes=6))
    for drawing in drawings:
        cosine, error = direction_and_speed_errors(drawing, turning)
        assert np.median(cosine) > 0.99 and np.median(np.abs(error)) < 0.05


def test_a_sketch_of_the_strokes_is_as_fast_as_it_is_said():
    vertices, faces = ring()
    (drawing,) = strokes_of_surface(
        vertices, faces, turning(vertices), StreamlineSettings(strokes=1)
    )
    (slow,) = slowed([drawing], 0.25)
    assert np.allclose(slow.speeds, drawing.speeds / 4) and np.allclose(
        slow.times, 4 * drawing.times
    )


def test_seeds_differ_and_repeat():
    vertices, faces = ring()
    first, again, other = (
        strokes_of_surface(vertices, faces, turning(vertices), StreamlineSettings(seed=seed))
        for seed in (0, 0, 1)
    )
    assert all(np.array_equal(a.points, b.points) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[0].points, other[0].points)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda v, f, u: (v, f, 0 * u), "velocities are zero"),
        (lambda v, f, u: (v, f[:0], u), "no faces"),
        (lambda v, f, u: (v[:0], f[:0], u[:0]), "no liquid"),
        (lambda v, f, u: (v, f, np.nan * u), "not numbers"),
    ],
)
def test_bad_input_says_what_to_do(spoil, says):
    vertices, faces = ring(size=24)
    with pytest.raises(FlowError, match=says):
        strokes_of_surface(*spoil(vertices, faces, turning(vertices)), StreamlineSettings())
