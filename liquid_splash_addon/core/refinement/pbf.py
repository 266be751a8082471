# SPDX-License-Identifier: GPL-3.0-or-later
"""Position-based fluids (Macklin and Mueller 2013) with cohesion (Akinci et al. 2013).

Particles may differ in size: each represents a cube of its own ``spacing``, and a pair interacts
by a kernel of their mean support. All lengths are in cells.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiling import njit
from .pairs import SUPPORT, find_pairs

DENSITY_ITERATIONS = 2
"""Iterations of the density constraints in each step: a squeezed drop stays compressed by 0.3 %."""

SOFTNESS = 0.05
"""Added to the constraint's denominator, in units of 1 / spacing^2: keeps it finite for particles
with few neighbours (Macklin and Mueller, eq. 11)."""

DENSITY_RELAXATION = 0.6
"""Share of each constraint's correction that is applied: all act on the same particles at once, and
together would overshoot and create speed out of nothing."""

MOST_MOVE = 0.3
"""Most spacings by which one iteration moves a particle."""

COHESION_MOVE = 0.05
"""Spacings by which cohesion 1 moves a particle in one step, per unit of its kernel."""

GATHER_SHARE = 0.12
"""Share of the way back to its drop's ball that cohesion 1 moves a particle in one step."""

VISCOSITY = 0.1, 0.5
"""XSPH viscosity: share of its neighbours' mean velocity that a particle adopts in each step, at
cohesion 0 and 1. What holds a drop together also evens out the flow within it."""

HALF, ONE, TWO, THREE, SIX = (np.float32(n) for n in (0.5, 1, 2, 3, 6))
SUPPORT_32, FACTOR = np.float32(SUPPORT), np.float32(8 / np.pi)
PEAK, TINY = np.float32(64), np.float32(1e-9)
"""Constants in single precision: one double makes a whole compiled loop double, and slower."""


class PbfParticles(NamedTuple):
    """Particles of position-based fluids.

    Attributes
    ----------
    positions : float32 ``(n, 3)``, cells
    velocities : float32 ``(n, 3)``, cells per second
    spacing : float32 ``(n,)``, edge of the cube of liquid that each represents, cells
    group : int32 ``(n,)``, number of the sample point that each was made around
    """

    positions: np.ndarray
    velocities: np.ndarray
    spacing: np.ndarray
    group: np.ndarray

    def take(self, which: np.ndarray) -> PbfParticles:
        """Return the particles that ``which`` (numbers or a bool mask) picks."""
        return PbfParticles(*(array[which] for array in self))


def simulate(particles: PbfParticles, steps: int, dt: float, cohesion: float) -> PbfParticles:
    """Return the particles after ``steps`` steps of ``dt`` seconds, without gravity or walls.

    cohesion : from 0 (they disperse) to 1 (they gather into round drops within a few steps). It
    acts per step, so that the look does not depend on cell size or real size.
    """
    positions = particles.positions.astype(np.float32)
    velocities = particles.velocities.astype(np.float32)
    spacing = particles.spacing.astype(np.float32)
    viscosity = np.float32(VISCOSITY[0] + cohesion * (VISCOSITY[1] - VISCOSITY[0]))
    settle_particles(positions, spacing)
    for _ in range(steps):
        predicted = positions + np.float32(dt) * velocities
        first, second = find_pairs(predicted, spacing)
        if cohesion > 0:
            _cohere(predicted, spacing, first, second, np.float32(cohesion * COHESION_MOVE))
            predicted = gathered(predicted, spacing, particles.group, cohesion * GATHER_SHARE)
        for _ in range(DENSITY_ITERATIONS):
            _relax(predicted, spacing, first, second)
        velocities = (predicted - positions) / np.float32(dt)
        _share_velocity(predicted, spacing, first, second, viscosity, velocities)
        positions = predicted
    return particles._replace(positions=positions, velocities=velocities)


def gathered(
    positions: np.ndarray, spacing: np.ndarray, group: np.ndarray, share: float
) -> np.ndarray:
    """Return ``positions`` with those outside the ball of their group moved back towards it.

    The ball has the volume of the group's particles and lies around their mean, which stays. This
    is the part of surface tension for which forces between neighbours do not reach far enough
    within a few steps.
    """
    count = np.maximum(np.bincount(group), 1)
    centre = np.stack([np.bincount(group, x) / count for x in positions.T], axis=1)
    radius = np.cbrt(0.75 / np.pi * np.bincount(group, spacing.astype(np.float64) ** 3))
    offset = positions - centre[group]
    distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
    back = -share * np.maximum(1 - radius[group] / distance, 0)[:, None] * offset
    back -= np.stack([np.bincount(group, x) / count for x in back.T], axis=1)[group]
    return (positions + back).astype(np.float32)


def settle_particles(positions: np.ndarray, spacing: np.ndarray) -> None:
    """Move particles apart that start too close to each other, in place, without adding speed."""
    first, second = find_pairs(positions, spacing)
    for _ in range(DENSITY_ITERATIONS):
        _relax(positions, spacing, first, second)


def densities(positions: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """Return the density at each particle over the rest density, float32 ``(n,)``."""
    first, second = find_pairs(positions, spacing)
    density = np.empty(len(positions), dtype=np.float32)
    _densities(positions, spacing, first, second, density)
    return density


@njit(cache=True, inline="always")
def _kernel(q):
    """Return the cubic spline at q = r / support, without the factor 8 / (pi support^3)."""
    if q < HALF:
        return ONE - SIX * q * q * (ONE - q)
    return TWO * (ONE - q) ** 3


@njit(cache=True, inline="always")
def _kernel_derivative(q):
    """Return the derivative of :func:`_kernel`."""
    if q < HALF:
        return SIX * q * (THREE * q - TWO)
    return -SIX * (ONE - q) ** 2


@njit(cache=True, inline="always")
def _spline(q):
    """Return the attraction of Akinci's cohesion kernel (eq. 2), scaled to 1 at its peak, q = 1/2.

    Its repulsion of near pairs is left to the density constraints.
    """
    return PEAK * (q * (ONE - q)) ** 3


@njit(cache=True, fastmath=True)
def _densities(positions, spacing, first, second, density):
    factor = 8.0 / np.pi / SUPPORT**3
    for p in range(len(positions)):
        density[p] = factor
    for n in range(len(first)):
        i, j = first[n], second[n]
        x = positions[i, 0] - positions[j, 0]
        y = positions[i, 1] - positions[j, 1]
        z = positions[i, 2] - positions[j, 2]
        support = 0.5 * SUPPORT * (spacing[i] + spacing[j])
        q = np.sqrt(x * x + y * y + z * z) / support
        if q < 1.0:
            w = 8.0 / np.pi / support**3 * _kernel(q)
            density[i] += spacing[j] ** 3 * w
            density[j] += spacing[i] ** 3 * w


@njit(cache=True, fastmath=True)
def _relax(positions, spacing, first, second):
    """Move particles apart where the density is above the rest density, in place: one iteration.

    C_i = sum_j V_j W_ij - 1 <= 0, with masses V. The gradients are those for particles of
    different sizes; for equal ones they are those of Macklin and Mueller (eqs. 8 to 12).
    """
    count, pairs = len(positions), len(first)
    gradients = np.zeros((pairs, 3), dtype=np.float32)
    own = np.zeros((count, 3), dtype=np.float32)
    squares = np.zeros(count, dtype=np.float32)
    density = np.full(count, FACTOR / SUPPORT_32**3, dtype=np.float32)
    for n in range(pairs):
        i, j = first[n], second[n]
        x = positions[i, 0] - positions[j, 0]
        y = positions[i, 1] - positions[j, 1]
        z = positions[i, 2] - positions[j, 2]
        support = HALF * SUPPORT_32 * (spacing[i] + spacing[j])
        r = np.sqrt(x * x + y * y + z * z)
        q = r / support
        if q >= ONE or r < TINY:
            continue
        scale = FACTOR / support**3
        vi, vj = spacing[i] ** 3, spacing[j] ** 3
        w = scale * _kernel(q)
        density[i] += vj * w
        density[j] += vi * w
        g = scale * _kernel_derivative(q) / (support * r)
        x, y, z = g * x, g * y, g * z
        gradients[n, 0], gradients[n, 1], gradients[n, 2] = x, y, z
        square = x * x + y * y + z * z
        squares[i] += vj * square
        squares[j] += vi * square
        own[i, 0] += vj * x
        own[i, 1] += vj * y
        own[i, 2] += vj * z
        own[j, 0] -= vi * x
        own[j, 1] -= vi * y
        own[j, 2] -= vi * z
    multiplier = squares
    for p in range(count):
        volume = spacing[p] ** 3
        total = (own[p, 0] ** 2 + own[p, 1] ** 2 + own[p, 2] ** 2) / volume + squares[p]
        soft = SOFTNESS / spacing[p] ** 2 / volume
        multiplier[p] = -DENSITY_RELAXATION * max(density[p] - 1.0, 0.0) / (total + soft)
    move = own
    move[:] = 0
    for n in range(pairs):
        i, j = first[n], second[n]
        vi, vj = spacing[i] ** 3, spacing[j] ** 3
        a = multiplier[i] * vj / vi + multiplier[j]
        b = multiplier[j] * vi / vj + multiplier[i]
        for axis in range(3):
            move[i, axis] += a * gradients[n, axis]
            move[j, axis] -= b * gradients[n, axis]
    _move(positions, spacing, move)


@njit(cache=True, fastmath=True)
def _cohere(positions, spacing, first, second, strength):
    """Draw particles together (Akinci, eq. 1), in place.

    The moves of a pair are opposite and weighted by volume, so momentum is preserved. The second
    term, the difference of normals, is left out: with so few particles in a drop it would drive
    them apart.
    """
    move = np.zeros_like(positions)
    for n in range(len(first)):
        i, j = first[n], second[n]
        mean = HALF * (spacing[i] + spacing[j])
        x = positions[i, 0] - positions[j, 0]
        y = positions[i, 1] - positions[j, 1]
        z = positions[i, 2] - positions[j, 2]
        r = np.sqrt(x * x + y * y + z * z)
        q = r / (SUPPORT_32 * mean)
        if q >= ONE or r < TINY:
            continue
        vi, vj = spacing[i] ** 3, spacing[j] ** 3
        f = -TWO * strength * mean * _spline(q) / (r * (vi + vj))
        a, b = f * vj, f * vi
        move[i, 0] += a * x
        move[i, 1] += a * y
        move[i, 2] += a * z
        move[j, 0] -= b * x
        move[j, 1] -= b * y
        move[j, 2] -= b * z
    _move(positions, spacing, move)


@njit(cache=True)
def _move(positions, spacing, move):
    """Move the particles, each by at most MOST_MOVE spacings, in place."""
    for p in range(len(positions)):
        far = np.sqrt(move[p, 0] ** 2 + move[p, 1] ** 2 + move[p, 2] ** 2)
        most = MOST_MOVE * spacing[p]
        share = most / far if far > most else 1.0
        for axis in range(3):
            positions[p, axis] += share * move[p, axis]


@njit(cache=True, fastmath=True)
def _share_velocity(positions, spacing, first, second, viscosity, velocities):
    """Apply XSPH viscosity (Macklin and Mueller, eq. 17), in place; momentum is preserved."""
    change = np.zeros_like(velocities)
    for n in range(len(first)):
        i, j = first[n], second[n]
        x = positions[i, 0] - positions[j, 0]
        y = positions[i, 1] - positions[j, 1]
        z = positions[i, 2] - positions[j, 2]
        support = HALF * SUPPORT_32 * (spacing[i] + spacing[j])
        q = np.sqrt(x * x + y * y + z * z) / support
        if q >= ONE:
            continue
        w = viscosity * FACTOR / support**3 * _kernel(q)
        vi, vj = w * spacing[i] ** 3, w * spacing[j] ** 3
        for axis in range(3):
            d = velocities[j, axis] - velocities[i, axis]
            change[i, axis] += vj * d
            change[j, axis] -= vi * d
    velocities += change
