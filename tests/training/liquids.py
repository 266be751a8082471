# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquids and tanks for the tests of the simulator."""

import numpy as np

from liquid_splash_addon.core.fluid.particles import Particles
from training.scenes.bodies import Body

ALONG_X = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
"""Axes of a tank whose length lies along x."""

SPACING = 0.0125
"""Metres; the tests' cells."""


def block(low, high, velocity=(0, 0, 0), jitter=0.02, seed=0):
    """Return particles, 8 a cell, between two corners (cells)."""
    axes = [np.arange(a + 0.25, b, 0.5) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points + np.random.default_rng(seed).uniform(-jitter, jitter, points.shape)
    return Particles.moving(points, np.array(velocity, float), 1 / 8)


def tank(half_width, half_length, centre=40.0):
    """Return a tank, longer along x, around (centre, centre, centre)."""
    return Body("tank", half_width, half_length, np.full(3, centre), ALONG_X)


def momentum(liquid):
    """Return volume times velocity, summed, in double precision."""
    particles = liquid.particles
    return (particles.velocities.astype(float) * particles.volumes[:, None]).sum(0)
