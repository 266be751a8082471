# SPDX-License-Identifier: GPL-3.0-or-later
"""Position-based fluids (Macklin and Mueller 2013) with cohesion (Akinci et al. 2013).

Particles may differ in size: each stands for a cube of its own ``spacing``, and a pair meets
with the mean of both kernels. All lengths are cells.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from .pairs import SUPPORT, find_pairs

ITERATIONS = 2
"""Of the density constraints, in each step. A squeezed drop is 0.3 % compressed afterwards."""

SOFTNESS = 0.05
"""Added to the constraint's denominator, in units of 1 / spacing^2: keeps it finite for particles
with few neighbours (Macklin and Mueller, eq. 11)."""

RELAXATION = 0.6
"""Share of each constraint's own correction that is made: all act at once on the same particles,
and whole ones would overshoot, which is speed out of nothing."""

MOST_MOVE = 0.3
"""Spacings that a particle is moved at most by one iteration."""

PULL = 0.05
"""Spacings by which cohesion 1 moves a particle in one step for each unit of its kernel."""

GATHER = 0.12
"""Share of the way back to its drop's ball that cohesion 1 moves a particle in one step."""

VISCOSITY = 0.1, 0.5
"""XSPH: share of the neighbours' mean velocity that a particle takes over in each step, at
cohesion 0 and 1: what holds a drop together also evens out the flow within it."""


HALF, ONE, TWO, THREE, SIX = (np.float32(n) for n in (0.5, 1, 2, 3, 6))
REACH, FACTOR = np.float32(SUPPORT), np.float32(8 / np.pi)
PEAK, TINY = np.float32(64), np.float32(1e-9)
"""In single precision: one double among them makes a compiled loop all double, and slower."""


class Drops(NamedTuple):
    """Particles of liquid.

    Attributes
    ----------
    positions : float32 ``(n, 3)``, cells
    velocities : float32 ``(n, 3)``, cells per second
    spacing : float32 ``(n,)``, edge of the cube of liquid that each stands for, cells
    group : int32 ``(n,)``, the sample that each was made around
    """

    positions: np.ndarray
    velocities: np.ndarray
    spacing: np.ndarray
    group: np.ndarray

    def take(self, which: np.ndarray) -> Drops:
        """Return the particles that ``which`` (numbers or a bool mask) picks."""
        return Drops(*(array[which] for array in self))


def simulate(drops: Drops, steps: int, dt: float, cohesion: float) -> Drops:
    """Return the particles ``steps`` times ``dt`` seconds later; no gravity, no walls.

    cohesion : 0 (they disperse) to 1 (they gather to round drops within a few steps). It is a
    speed per step, so that a look does not change with cell size or real size.
    """
    positions = drops.positions.astype(np.float32)
    velocities = drops.velocities.astype(np.float32)
    spacing = drops.spacing.astype(np.float32)
    viscosity = np.float32(VISCOSITY[0] + cohesion * (VISCOSITY[1] - VISCOSITY[0]))
    settle(positions, spacing)
    for _ in range(steps):
        predicted = positions + np.float32(dt) * velocities
        first, second = find_pairs(predicted, spacing)
        if cohesion > 0:
            _cohere(predicted, spacing, first, second, np.float32(cohesion * PULL))
            predicted = gathered(predicted, spacing, drops.group, cohesion * GATHER)
        for _ in range(ITERATIONS):
            _relax(predicted, spacing, first, second)
        velocities = (predicted - positions) / np.float32(dt)
        _share_velocity(predicted, spacing, first, second, viscosity, velocities)
        positions = predicted
    return drops._replace(positions=positions, velocities=velocities)


def gathered(
    positions: np.ndarray, spacing: np.ndarray, group: np.ndarray, share: float
) -> np.ndarray:
    """Return ``positions`` with those outside the ball of their group moved back towards it.

    The ball has the volume of the group's particles, around their mean. It is the part of
    surface tension that forces between neighbours are too short to give within a few steps.
    The group's mean stays.
    """
    count = np.maximum(np.bincount(group), 1)
    centre = np.stack([np.bincount(group, x) / count for x in positions.T], axis=1)
    radius = np.cbrt(0.75 / np.pi * np.bincount(group, spacing.astype(np.float64) ** 3))
    offset = positions - centre[group]
    distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
    back = -share * np.maximum(1 - radius[group] / distance, 0)[:, None] * offset
    back -= np.stack([np.bincount(group, x) / count for x in back.T], axis=1)[group]
    return (positions + back).astype(np.float32)


def settle(positions: np.ndarray, spacing: np.ndarray) -> None:
    """Move particles apart that begin too close to each other, in place; gives them no speed."""
    first, second = find_pairs(positions, spacing)
    for _ in range(ITERATIONS):
        _relax(positions, spacing, first, second)


def densities(positions: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """Return the density of each particle over that at rest, float32 ``(n,)``."""
    first, second = find_pairs(positions, spacing)
    density = np.empty(len(positions), dtype=np.float32)
    _densities(positions, spacing, first, second, density)
    return density


@njit(cache=True, inline="always")
def _kernel(q):
    """Return the cubic spline at q = r / support, without its factor 8 / (pi support^3)."""
    if q < HALF:
        return ONE - SIX * q * q * (ONE - q)
    return TWO * (ONE - q) ** 3


@njit(cache=True, inline="always")
def _slope(q):
    """Return the derivative of :func:`_kernel`."""
    if q < HALF:
        return SIX * q * (THREE * q - TWO)
    return -SIX * (ONE - q) ** 2


@njit(cache=True, inline="always")
def _spline(q):
    """Return the attraction of Akinci's cohesion (eq. 2), scaled to a peak of 1 at q = 1/2.

    His repulsion of near pairs is left to the density constraints.
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
    """One iteration: move the particles where the density is above that at rest, in place.

    C_i = sum_j V_j W_ij - 1 <= 0, with masses V: the gradients below are those of particles
    of different size; for equal ones they are the paper's (eqs. 8 to 12).
    """
    count, pairs = len(positions), len(first)
    slopes = np.zeros((pairs, 3), dtype=np.float32)
    own = np.zeros((count, 3), dtype=np.float32)
    squares = np.zeros(count, dtype=np.float32)
    density = np.full(count, FACTOR / REACH**3, dtype=np.float32)
    for n in range(pairs):
        i, j = first[n], second[n]
        x = positions[i, 0] - positions[j, 0]
        y = positions[i, 1] - positions[j, 1]
        z = positions[i, 2] - positions[j, 2]
        support = HALF * REACH * (spacing[i] + spacing[j])
        r = np.sqrt(x * x + y * y + z * z)
        q = r / support
        if q >= ONE or r < TINY:
            continue
        scale = FACTOR / support**3
        vi, vj = spacing[i] ** 3, spacing[j] ** 3
        w = scale * _kernel(q)
        density[i] += vj * w
        density[j] += vi * w
        g = scale * _slope(q) / (support * r)
        x, y, z = g * x, g * y, g * z
        slopes[n, 0], slopes[n, 1], slopes[n, 2] = x, y, z
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
        multiplier[p] = -RELAXATION * max(density[p] - 1.0, 0.0) / (total + soft)
    move = own
    move[:] = 0
    for n in range(pairs):
        i, j = first[n], second[n]
        vi, vj = spacing[i] ** 3, spacing[j] ** 3
        a = multiplier[i] * vj / vi + multiplier[j]
        b = multiplier[j] * vi / vj + multiplier[i]
        for axis in range(3):
            move[i, axis] += a * slopes[n, axis]
            move[j, axis] -= b * slopes[n, axis]
    _move(positions, spacing, move)


@njit(cache=True, fastmath=True)
def _cohere(positions, spacing, first, second, strength):
    """Draw particles together (Akinci, eq. 1), in place.

    A pair's moves are opposite and weighed by volume, so momentum is kept. His second term,
    the difference of normals, is left out: with so few particles to a drop it drove them apart.
    """
    move = np.zeros_like(positions)
    for n in range(len(first)):
        i, j = first[n], second[n]
        mean = HALF * (spacing[i] + spacing[j])
        x = positions[i, 0] - positions[j, 0]
        y = positions[i, 1] - positions[j, 1]
        z = positions[i, 2] - positions[j, 2]
        r = np.sqrt(x * x + y * y + z * z)
        q = r / (REACH * mean)
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
    """XSPH viscosity (Macklin and Mueller, eq. 17), in place; momentum is kept."""
    change = np.zeros_like(velocities)
    for n in range(len(first)):
        i, j = first[n], second[n]
        x = positions[i, 0] - positions[j, 0]
        y = positions[i, 1] - positions[j, 1]
        z = positions[i, 2] - positions[j, 2]
        support = HALF * REACH * (spacing[i] + spacing[j])
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
