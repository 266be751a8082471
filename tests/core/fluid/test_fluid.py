# SPDX-License-Identifier: GPL-3.0-or-later
"""The physics against closed forms."""

import numpy as np
import pytest

from liquid_splash_addon.core.fluid.advection import advect
from liquid_splash_addon.core.fluid.cells import activate, sort_by_cell
from liquid_splash_addon.core.fluid.extrapolation import extrapolate, valid_faces
from liquid_splash_addon.core.fluid.particles import Particles
from liquid_splash_addon.core.fluid.pressure import Poisson, divergence, project
from liquid_splash_addon.core.fluid.transfer import faces_to_particles, particles_to_faces, sample

BOX = (64, 64, 64)
GRADIENT = np.array([[0.5, 0.2, -0.1], [0.3, -0.4, 0.2], [0.1, 0.6, -0.1]], np.float32)
"""Trace zero: a linear flow without divergence."""


def block(low=20, high=32, seed=0):
    """Return 8 particles a cell, jittered, in a cube of cells."""
    axis = np.arange(low, high, 0.5) + 0.25
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points + np.random.default_rng(seed).uniform(-0.2, 0.2, points.shape)
    return points.astype(np.float32)


def particles_at(positions, velocities, affine=None):
    """Return particles of an eighth of a cell."""
    out = Particles.moving(positions, np.zeros(3), 1 / 8)._replace(velocities=velocities)
    return out if affine is None else out._replace(affine=affine)


def projected(faces, cells, share, rtol):
    """Return the faces made free of divergence, to ``rtol``."""
    matrix = Poisson.assemble(cells, share)

    class Exact(Poisson):
        def solve(self, rhs, letting_go):
            return Poisson.solve(self, rhs, letting_go, rtol)

    return project(faces, cells, share, Exact(*matrix))


def linear(points):
    """Return the linear test flow at ``points``."""
    return ((points - 26) @ GRADIENT.T).astype(np.float32)


def face_positions(cells, axis):
    """Return where the lower faces of the cells along ``axis`` lie."""
    offset = np.full(3, 0.5)
    offset[axis] = 0
    return cells.coordinates + offset


def test_active_cells_are_the_particles_cells_and_a_shell():
    positions = block()
    cells = activate(positions, BOX, layers=2)
    assert cells.liquid == 12**3
    assert (np.unique(positions.astype(int), axis=0).tolist()
            == np.unique(cells.coordinates[: cells.liquid], axis=0).tolist())  # fmt: skip
    # one box shell, then the six faces of that
    assert len(cells.coordinates) == 14**3 + 6 * 14**2
    for c in (0, 700, cells.liquid - 1):
        beyond = cells.coordinates[cells.neighbours[c]] - cells.coordinates[c]
        assert beyond.tolist() == [
            [-1, 0, 0],
            [1, 0, 0],
            [0, -1, 0],
            [0, 1, 0],
            [0, 0, -1],
            [0, 0, 1],
        ]


def test_cost_follows_the_liquid_not_the_box():
    small = activate(block(), (64,) * 3, 2)
    large = activate(block(), (512,) * 3, 2)
    assert len(small.leaves) == len(large.leaves)
    assert len(small.coordinates) == len(large.coordinates)


def test_sorting_puts_particles_of_a_cell_together():
    positions = np.random.default_rng(1).permutation(block())
    cells = activate(positions, BOX)
    order, counts = sort_by_cell(positions, cells)
    assert (counts == 8).all()
    assert sorted(order.tolist()) == list(range(len(positions)))
    homes = positions[order].astype(int) @ [1, 64, 4096]
    assert (np.diff(homes) != 0).sum() == cells.liquid - 1


def test_apic_carries_a_linear_flow_exactly():
    positions = block()
    cells = activate(positions, BOX)
    affine = np.tile(GRADIENT, (len(positions), 1, 1))
    faces, weights = particles_to_faces(particles_at(positions, linear(positions), affine), cells)
    for axis in range(3):
        hit = weights[:, axis] > 1e-3
        expected = linear(face_positions(cells, axis))[:, axis]
        assert np.abs(faces[hit, axis] - expected[hit]).max() < 1e-4


def test_apic_brings_a_linear_flow_back():
    positions = block()
    cells = activate(positions, BOX)
    faces = np.stack([linear(face_positions(cells, a))[:, a] for a in range(3)], axis=1)
    old = particles_at(positions, 0 * positions)
    new, there = faces_to_particles(old, cells, faces, faces, 0.0)
    assert np.abs(new.velocities - linear(positions)).max() < 1e-4
    assert np.abs(new.affine - GRADIENT).max() < 1e-4
    assert np.array_equal(there, new.velocities)
    assert np.abs(sample(positions, cells, faces) - linear(positions)).max() < 1e-4


def test_flip_adds_only_the_change():
    positions = block()
    cells = activate(positions, BOX)
    before = np.zeros((len(cells.coordinates), 3), np.float32)
    after = before + np.float32(2.0)
    old = particles_at(positions, 3 + 0 * positions)
    new, there = faces_to_particles(old, cells, before, after, 1.0)
    assert np.allclose(new.velocities, 5.0) and not new.affine.any()
    assert np.allclose(there, 2.0)


def test_transfer_conserves_momentum():
    positions = block()
    velocities = np.random.default_rng(2).normal(size=positions.shape).astype(np.float32)
    cells = activate(positions, BOX)
    volumes = np.random.default_rng(3).uniform(0.05, 0.2, len(positions)).astype(np.float32)
    moving = particles_at(positions, velocities)._replace(volumes=volumes)
    faces, weights = particles_to_faces(moving, cells)
    momentum = (velocities * volumes[:, None]).sum(0)
    assert np.allclose((faces * weights).sum(0), momentum, rtol=1e-3, atol=0.01)


def test_projection_leaves_no_divergence_and_keeps_what_has_none():
    positions = block()
    cells = activate(positions, BOX)
    share = np.ones((len(cells.coordinates), 3), np.float32)
    rough = np.random.default_rng(3).normal(size=share.shape).astype(np.float32)
    before = np.sqrt((divergence(rough, cells, share) ** 2).mean())
    after = divergence(projected(rough, cells, share, 1e-6), cells, share)
    assert np.sqrt((after**2).mean()) < 1e-5 * before
    smooth = np.stack([linear(face_positions(cells, a))[:, a] for a in range(3)], axis=1)
    assert np.abs(projected(smooth, cells, share, 1e-4) - smooth).max() < 1e-3


def test_hydrostatic_pressure_stops_liquid_on_a_floor_in_a_tank():
    positions = block()
    cells = activate(positions, BOX)
    share = np.ones((len(cells.coordinates), 3), np.float32)
    for axis in range(3):  # walls all around the block, open on top
        share[cells.coordinates[:, axis] == 20, axis] = 0
        if axis < 2:
            share[cells.coordinates[:, axis] == 32, axis] = 0
    faces = np.zeros_like(share)
    faces[:, 2] = -1.0
    valid = valid_faces(cells, share)
    inner = projected(faces * valid, cells, share, 1e-7)
    assert np.abs(inner[: cells.liquid][valid[: cells.liquid]]).max() < 1e-3


def test_walls_let_go():
    """Liquid moving away from a wall keeps its speed: nothing sucks it back."""
    positions = block()
    cells = activate(positions, BOX)
    share = np.ones((len(cells.coordinates), 3), np.float32)
    share[cells.coordinates[:, 2] == 20, 2] = 0
    faces = np.zeros_like(share)
    faces[:, 2] = 1.0
    out = projected(faces, cells, share, 1e-6)
    above = (cells.coordinates[:, 2] > 20) & (np.arange(len(share)) < cells.liquid)
    assert out[above, 2].min() > 0.95


def test_extrapolation_continues_a_constant_and_stops():
    cells = activate(block(), BOX, layers=3)
    share = np.ones((len(cells.coordinates), 3), np.float32)
    valid = valid_faces(cells, share)
    faces = np.where(valid, 7.0, -1.0).astype(np.float32)
    extrapolate(faces, valid, cells, layers=2)
    reached = faces != 0
    assert (faces[reached] == 7.0).all()
    assert reached.sum() > valid.sum() and not reached.all()


@pytest.mark.parametrize("halving", [1, 2])
def test_advection_is_second_order(halving):
    """In a rotation the midpoint rule's radius error falls eightfold when the step is halved."""
    positions = block(20, 44)
    cells = activate(positions, BOX)
    spin = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]], np.float32)
    faces = np.stack(
        [((face_positions(cells, a) - 32) @ spin.T)[:, a] for a in range(3)], axis=1
    ).astype(np.float32)
    start = np.array([[38.0, 32.0, 32.0]], np.float32)
    errors = []
    for dt in (0.4 / halving, 0.2 / halving):
        first = sample(start, cells, faces)
        moved = advect(start, first, cells, faces, dt)[0].astype(float) - 32
        exact = 6 * np.array([np.cos(dt), np.sin(dt), 0])
        errors.append(np.linalg.norm(moved - exact))
    assert errors[1] < errors[0] / 6
