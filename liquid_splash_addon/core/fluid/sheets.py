# SPDX-License-Identifier: GPL-3.0-or-later
"""Keep thin sheets evenly sampled: split particles where the flow draws them apart.

Without it a sheet thinner than a cell tears into webs wherever particles happen to lie far
apart. Each particle carries the stretch of the liquid around it (the left Cauchy-Green tensor,
moved by APIC's velocity gradient). Where a cell holds too few particles and the stretch along
one direction is large, the particle becomes two along it, each with half the volume: mass,
momentum and the linear velocity field stay as they are. Where light particles crowd again, pairs
are merged. Compare Ando, Thuerey and Tsuruno 2012, who insert by the positions of neighbours.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .cells import Cells, find
from .particles import Particles

FULL = 8
"""Particles in a cell from which on it counts as evenly sampled."""

SPLIT = 1.5
"""A particle is split when the liquid has been drawn out this many times along one axis."""

LEAST = 1 / 32
"""Cells^3: no particle becomes smaller, a sheet thinner than this may tear."""

COMPANY = 5
"""Particles in the 27 cells around a particle, itself included, below which it is spray, not
a sheet, and left whole."""

CROWD = 16
"""Particles in a cell from which on light ones are merged in pairs."""

SPACING = 0.5
"""Distance of particles in liquid that has not been stretched, cells: 8 a cell."""


def resample_sheets(
    particles: Particles, were: np.ndarray, cells: Cells, counts: np.ndarray, dt: float
) -> Particles:
    """Return the particles after ``dt`` seconds of stretch, split and merged where needed.

    were : ``(n, 3)`` positions at the beginning of the step, sorted by cell; counts : int64
    ``(liquid,)`` particles that each cell then had. Volume and momentum are kept.
    """
    grow_stretch(particles.stretch, particles.affine, np.float32(dt))
    axes = _axes_to_split(
        were, particles.volumes, particles.stretch, cells.table, cells.leaves, counts
    )
    which = np.flatnonzero(axes.any(axis=1))
    if len(which):
        particles = split(particles, which, axes[which])
    return merge(particles, counts)


@njit(cache=True, fastmath=True)
def grow_stretch(stretch, affine, dt):
    """Move B ``(n, 3, 3)`` by ``B <- (1 + dt C) B (1 + dt C)^T``, in place."""
    f = np.empty((3, 3), dtype=np.float32)
    t = np.empty((3, 3), dtype=np.float32)
    for p in range(len(stretch)):
        for a in range(3):
            for b in range(3):
                f[a, b] = dt * affine[p, a, b]
            f[a, a] += 1
        for a in range(3):
            for b in range(3):
                t[a, b] = (
                    f[a, 0] * stretch[p, 0, b]
                    + f[a, 1] * stretch[p, 1, b]
                    + f[a, 2] * stretch[p, 2, b]
                )
        for a in range(3):
            for b in range(3):
                stretch[p, a, b] = t[a, 0] * f[b, 0] + t[a, 1] * f[b, 1] + t[a, 2] * f[b, 2]


@njit(cache=True)
def _axes_to_split(positions, volumes, stretch, table, leaves, counts):
    """Return ``(n, 3)``: the largest stretch times its direction where a particle is to be split.

    Zero elsewhere. Where the sampling is even, the stretch is forgotten.
    """
    out = np.zeros((len(positions), 3), dtype=np.float32)
    for p in range(len(positions)):
        i, j, k = int(positions[p, 0]), int(positions[p, 1]), int(positions[p, 2])
        if counts[find(table, leaves, i, j, k)] >= FULL:
            for a in range(3):
                for b in range(3):
                    stretch[p, a, b] = 1.0 if a == b else 0.0
            continue
        if volumes[p] < 2 * LEAST or _norm(stretch[p]) < SPLIT * SPLIT:
            continue
        square = largest_stretch(stretch[p], out[p])
        if square < SPLIT * SPLIT or _company(table, leaves, counts, i, j, k) < COMPANY:
            out[p] = 0.0
    return out


@njit(cache=True, inline="always")
def _norm(b):
    """Return the Frobenius norm of ``(3, 3)``, which no eigenvalue exceeds."""
    square = b[0, 0] ** 2 + b[1, 1] ** 2 + b[2, 2] ** 2
    return np.sqrt(square + 2 * (b[0, 1] ** 2 + b[0, 2] ** 2 + b[1, 2] ** 2))


@njit(cache=True)
def largest_stretch(b, axis):
    """Write the largest principal stretch of B ``(3, 3)`` times its direction into ``axis``.

    Returns its square, the largest eigenvalue. By power iteration: the axis needs no precision.
    """
    # B's largest column is never across the axis.
    column = 0 if b[0, 0] >= max(b[1, 1], b[2, 2]) else 1 if b[1, 1] >= b[2, 2] else 2
    x, y, z = b[0, column], b[1, column], b[2, column]
    size = np.float32(1)
    for _ in range(12):
        size = max(np.sqrt(x * x + y * y + z * z), np.float32(1e-12))
        x, y, z = x / size, y / size, z / size
        x, y, z = (
            b[0, 0] * x + b[0, 1] * y + b[0, 2] * z,
            b[1, 0] * x + b[1, 1] * y + b[1, 2] * z,
            b[2, 0] * x + b[2, 1] * y + b[2, 2] * z,
        )
    square = np.sqrt(x * x + y * y + z * z)
    scale = 1 / max(np.sqrt(square), 1e-12)
    axis[0], axis[1], axis[2] = x * scale, y * scale, z * scale
    return square


@njit(cache=True)
def _company(table, leaves, counts, i, j, k):
    """Return how many particles the 27 cells around (i, j, k) hold."""
    near = 0
    for a in range(-1, 2):
        for b in range(-1, 2):
            for c in range(-1, 2):
                n = find(table, leaves, i + a, j + b, k + c)
                if 0 <= n < len(counts):
                    near += counts[n]
    return near


def split(particles: Particles, which: np.ndarray, axes: np.ndarray) -> Particles:
    """Return the particles with those of ``which`` (numbers) halved along ``axes``.

    axes : ``(len(which), 3)``, the stretch along each axis times its direction. The halves lie
    where the halves of the drawn-out liquid have their middles; the second ones come last.
    """
    size = np.linalg.norm(axes, axis=1, keepdims=True)
    # Four times the even spacing is more than a sheet can have: it is the noise of spray.
    offset = SPACING / 4 * axes * np.minimum(1, 4 / size)
    left, right = particles.take(which), particles.take(which)
    change = np.einsum("nab,nb->na", left.affine, offset)
    halved = left.stretch - 0.75 * axes[:, :, None] * axes[:, None, :]
    left = left._replace(
        positions=left.positions + offset,
        velocities=left.velocities + change,
        volumes=left.volumes / 2,
        stretch=halved,
    )
    right = right._replace(
        positions=right.positions - offset,
        velocities=right.velocities - change,
        volumes=right.volumes / 2,
        stretch=halved,
    )
    arrays = []
    for whole, first, second in zip(particles, left, right, strict=True):
        whole = whole.copy()
        whole[which] = first
        arrays.append(np.concatenate([whole, second.astype(np.float32)]))
    return Particles(*arrays)


def merge(particles: Particles, counts: np.ndarray) -> Particles:
    """Return the particles with light neighbours in crowded cells joined in pairs.

    particles : the first ``counts.sum()`` are sorted by cell; changed in place. A pair becomes
    one at its centre of mass with its mean velocity.
    """
    keep = np.ones(len(particles.positions), dtype=np.bool_)
    positions, velocities, affine, volumes, _ = particles
    merged = _merge(positions, velocities, affine, volumes, counts, keep)
    return particles.take(keep) if merged else particles


@njit(cache=True)
def _merge(positions, velocities, affine, volumes, counts, keep):
    start, merged = 0, 0
    for cell in range(len(counts)):
        end = start + counts[cell]
        if counts[cell] >= CROWD:
            waiting = -1
            for p in range(start, end):
                if volumes[p] > 2 * LEAST:
                    continue
                if waiting < 0:
                    waiting = p
                    continue
                total = volumes[p] + volumes[waiting]
                w = volumes[p] / total
                for a in range(3):
                    positions[waiting, a] += w * (positions[p, a] - positions[waiting, a])
                    velocities[waiting, a] += w * (velocities[p, a] - velocities[waiting, a])
                    for b in range(3):
                        affine[waiting, a, b] += w * (affine[p, a, b] - affine[waiting, a, b])
                volumes[waiting] = total
                keep[p] = False
                waiting = -1
                merged += 1
        start = end
    return merged
