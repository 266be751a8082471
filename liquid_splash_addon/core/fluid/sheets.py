# SPDX-License-Identifier: GPL-3.0-or-later
"""Even sampling of thin sheets: particles are split where the flow draws them apart.

Without it a sheet thinner than a cell tears into webs wherever particles happen to lie far
apart. Each particle carries the stretch of the liquid around it (the left Cauchy-Green tensor,
advanced by APIC's velocity gradient). Where a cell holds too few particles and the stretch along
one direction is large, a particle becomes two along it, each with half the volume: mass, momentum
and the linear velocity field are preserved. Where light particles crowd again, pairs are merged.
Compare Ando, Thuerey and Tsuruno 2012, who insert particles by the positions of neighbours.
"""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from .cells import Cells, find
from .particles import Particles

EVEN_COUNT = 8
"""Particles with which a cell counts as evenly sampled."""

SPLIT_STRETCH = 1.5
"""A particle is split when the liquid has been stretched by this factor along one axis."""

LEAST_VOLUME = 1 / 32
"""Cells^3. No particle becomes smaller; a sheet thinner than this may tear."""

SHEET_COUNT = 5
"""Particles in the 27 cells around a particle, itself included, from which it is part of a sheet;
with fewer it is spray and left whole."""

MERGE_COUNT = 16
"""Particles in a cell from which light ones are merged in pairs."""

PARTICLE_SPACING = 0.5
"""Distance of particles in unstretched liquid, cells: 8 particles in a cell."""


def resample_sheets(
    particles: Particles, were: np.ndarray, cells: Cells, counts: np.ndarray, dt: float
) -> Particles:
    """Return the particles after ``dt`` seconds of stretch, split and merged where needed.

    were : ``(n, 3)``, positions at the beginning of the step, sorted by cell; counts : int
    ``(liquid,)``, particles in each cell at that time. Volume and momentum are preserved.
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
    """Advance B ``(n, 3, 3)`` by ``B <- (1 + dt C) B (1 + dt C)^T``, in place."""
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
    """Return the largest stretch times its direction, ``(n, 3)``; 0 for particles not to be split.

    Where the sampling is even, the stretch is reset.
    """
    out = np.zeros((len(positions), 3), dtype=np.float32)
    for p in range(len(positions)):
        i, j, k = int(positions[p, 0]), int(positions[p, 1]), int(positions[p, 2])
        if counts[find(table, leaves, i, j, k)] >= EVEN_COUNT:
            for a in range(3):
                for b in range(3):
                    stretch[p, a, b] = 1.0 if a == b else 0.0
            continue
        if volumes[p] < 2 * LEAST_VOLUME or _norm(stretch[p]) < SPLIT_STRETCH * SPLIT_STRETCH:
            continue
        square = largest_stretch(stretch[p], out[p])
        if (
            square < SPLIT_STRETCH * SPLIT_STRETCH
            or _particles_around(table, leaves, counts, i, j, k) < SHEET_COUNT
        ):
            out[p] = 0.0
    return out


@njit(cache=True, inline="always")
def _norm(b):
    """Return the Frobenius norm of a ``(3, 3)`` matrix, which no eigenvalue exceeds."""
    square = b[0, 0] ** 2 + b[1, 1] ** 2 + b[2, 2] ** 2
    return np.sqrt(square + 2 * (b[0, 1] ** 2 + b[0, 2] ** 2 + b[1, 2] ** 2))


@njit(cache=True)
def largest_stretch(b, axis):
    """Write the largest principal stretch of B ``(3, 3)`` times its direction into ``axis``.

    Returns its square, the largest eigenvalue. By power iteration, as a rough axis will do.
    """
    # B's largest column is never perpendicular to the axis.
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
def _particles_around(table, leaves, counts, i, j, k):
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

    axes : ``(len(which), 3)``, the stretch along each axis times its direction. The halves lie in
    the middles of the halves of the stretched liquid; the second ones come last.
    """
    size = np.linalg.norm(axes, axis=1, keepdims=True)
    # More than four times the even spacing does not occur in sheets: it is the noise of spray.
    offset = PARTICLE_SPACING / 4 * axes * np.minimum(1, 4 / size)
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
    """Return the particles with light ones in crowded cells merged in pairs.

    particles : changed in place; the first ``counts.sum()`` are sorted by cell. A pair becomes one
    particle at its centre of mass, with its mean velocity.
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
        if counts[cell] >= MERGE_COUNT:
            waiting = -1
            for p in range(start, end):
                if volumes[p] > 2 * LEAST_VOLUME:
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
