# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface tension against Young and Laplace."""

import numpy as np
import pytest

from liquid_splash_addon.core.fluid.cells import activate, sort_by_cell
from liquid_splash_addon.core.fluid.particles import Particles
from liquid_splash_addon.core.fluid.surface_tension import surface_pressure

BOX = (64, 64, 64)


def ball(radius):
    """Return a ball of evenly spaced particles around the box's middle."""
    axis = np.arange(12, 52, 0.5) + 0.25
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.linalg.norm(points - 32, axis=1) < radius
    return Particles.moving(points[inside], np.zeros(3), 1 / 8)


def beside_liquid(cells):
    """Return which cells are air beside liquid: the ones whose pressure counts."""
    beside = np.zeros(len(cells.coordinates), dtype=bool)
    near = cells.neighbours[: cells.liquid].ravel()
    beside[near[near >= cells.liquid]] = True
    return beside


@pytest.mark.parametrize("radius", [6.0, 9.0, 12.0])
def test_a_balls_surface_presses_with_twice_its_curvature(radius):
    particles = ball(radius)
    cells = activate(particles.positions, BOX, 2)
    order, _ = sort_by_cell(particles.positions, cells)
    pressure = surface_pressure(particles.take(order), cells, strength=3.0)
    beside = beside_liquid(cells)
    assert pressure[beside].mean() == pytest.approx(3.0 * 2 / radius, rel=0.25)
    assert pressure[beside].std() < 0.6 * 3.0 * 2 / radius


def test_flat_liquid_feels_none():
    axis = np.arange(12, 52, 0.5) + 0.25
    points = np.stack(np.meshgrid(axis, axis, axis[24:56], indexing="ij"), axis=-1).reshape(-1, 3)
    particles = Particles.moving(points, np.zeros(3), 1 / 8)
    cells = activate(particles.positions, BOX, 2)
    pressure = surface_pressure(particles, cells, strength=1.0)
    middle = (np.abs(cells.coordinates[:, :2] + 0.5 - 32) < 12).all(axis=1)
    assert np.abs(pressure[middle & beside_liquid(cells)]).max() < 1e-3
