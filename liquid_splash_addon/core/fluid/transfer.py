# SPDX-License-Identifier: GPL-3.0-or-later
"""Velocity from particles to faces and back (FLIP: Zhu and Bridson 2005; APIC: Jiang 2015)."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from .cells import Cells, find
from .particles import Particles


def particles_to_faces(particles: Particles, cells: Cells) -> tuple[np.ndarray, np.ndarray]:
    """Return face velocities and weights, float32 ``(cells, 3)`` each.

    A face receives the mean of ``v_p + C_p (x_face - x_p)``, with the particles' volumes and
    trilinear weights.

    particles : sorted by cell for speed.
    """
    faces = np.zeros((len(cells.coordinates), 3), dtype=np.float32)
    weights = np.zeros_like(faces)
    positions, velocities, affine, volumes, _ = particles
    _scatter(positions, velocities, affine, volumes, cells.table, cells.leaves, faces, weights)
    np.divide(faces, weights, out=faces, where=weights > 0)
    return faces, weights


def faces_to_particles(
    particles: Particles, cells: Cells, before: np.ndarray, after: np.ndarray, flip: float
) -> tuple[Particles, np.ndarray]:
    """Return the particles with new velocities and affine matrices, and the grid's velocity there.

    ``v <- flip (v + sample(after - before)) + (1 - flip) sample(after)``; the affine part is
    the gradient of the sampled velocity times ``1 - flip``: flip = 0 is APIC and flip = 1 is FLIP.
    The second result is ``sample(after)``, ``(n, 3)``.

    before, after : face velocities ``(cells, 3)`` before and after the forces, extrapolated;
    flip : 0..1.
    """
    out = np.empty_like(particles.velocities)
    there = out if flip == 0 else np.empty_like(out)
    affine = np.empty((len(out), 3, 3), dtype=np.float32)
    positions, velocities = particles.positions, particles.velocities
    table, leaves = cells.table, cells.leaves
    _gather(
        positions, velocities, table, leaves, before, after, np.float32(flip), out, there, affine
    )
    return particles._replace(velocities=out, affine=affine), there


@njit(cache=True, inline="always")
def load_stencil(table, leaves, i, j, k, stencil):
    """Write the numbers of the 27 cells around (i, j, k) into ``stencil`` ``(3, 3, 3)``.

    Returns whether all of them are active.
    """
    lowest = np.int32(0)
    for a in range(3):
        for b in range(3):
            for c in range(3):
                n = find(table, leaves, i + a - 1, j + b - 1, k + c - 1)
                stencil[a, b, c] = n
                lowest = min(lowest, n)
    return lowest >= 0


@njit(cache=True, inline="always")
def face_corner(x, y, z, i, j, k, axis):
    """Return the first of the 8 faces of ``axis`` around (x, y, z), and their weights.

    The first is relative to cell (i, j, k) - 1; the weights are those of the upper faces.
    """
    # Single precision throughout: x - i is exact, and mixing in an integer would make it double.
    half, one = np.float32(0.5), np.float32(1)
    fx = x - np.float32(i) + (one if axis == 0 else half)
    fy = y - np.float32(j) + (one if axis == 1 else half)
    fz = z - np.float32(k) + (one if axis == 2 else half)
    a, b, c = int(fx), int(fy), int(fz)
    return a, b, c, fx - np.float32(a), fy - np.float32(b), fz - np.float32(c)


@njit(cache=True, fastmath=True)
def _scatter(positions, velocities, affine, volumes, table, leaves, faces, weights):
    stencil = np.empty((3, 3, 3), dtype=np.int32)
    li, lj, lk = -9, -9, -9
    one = np.float32(1)
    for p in range(len(positions)):
        x, y, z = positions[p, 0], positions[p, 1], positions[p, 2]
        i, j, k = int(x), int(y), int(z)
        if i != li or j != lj or k != lk:
            load_stencil(table, leaves, i, j, k, stencil)
            li, lj, lk = i, j, k
        for axis in range(3):
            a, b, c, wx, wy, wz = face_corner(x, y, z, i, j, k, axis)
            v, volume = velocities[p, axis], volumes[p]
            cx, cy, cz = affine[p, axis, 0], affine[p, axis, 1], affine[p, axis, 2]
            for da in range(2):
                ua = volume * (wx if da else one - wx)
                va = v + cx * (np.float32(da) - wx)
                for db in range(2):
                    ub = ua * (wy if db else one - wy)
                    vb = va + cy * (np.float32(db) - wy)
                    for dc in range(2):
                        w = ub * (wz if dc else one - wz)
                        n = stencil[a + da, b + db, c + dc]
                        faces[n, axis] += w * (vb + cz * (np.float32(dc) - wz))
                        weights[n, axis] += w


@njit(cache=True, fastmath=True)
def _gather(positions, velocities, table, leaves, before, after, flip, out, there, affine):
    stencil = np.empty((3, 3, 3), dtype=np.int32)
    li, lj, lk = -9, -9, -9
    one = np.float32(1)
    keep = one - flip
    for p in range(len(positions)):
        x, y, z = positions[p, 0], positions[p, 1], positions[p, 2]
        i, j, k = int(x), int(y), int(z)
        if i != li or j != lj or k != lk:
            load_stencil(table, leaves, i, j, k, stencil)
            li, lj, lk = i, j, k
        for axis in range(3):
            a, b, c, wx, wy, wz = face_corner(x, y, z, i, j, k, axis)
            new, change = np.float32(0), np.float32(0)
            gx, gy, gz = np.float32(0), np.float32(0), np.float32(0)
            for da in range(2):
                ua = wx if da else one - wx
                for db in range(2):
                    ub = wy if db else one - wy
                    for dc in range(2):
                        uc = wz if dc else one - wz
                        n = stencil[a + da, b + db, c + dc]
                        u = after[n, axis]
                        w = ua * ub * uc
                        new += w * u
                        if flip > 0:
                            change += w * (u - before[n, axis])
                        gx += (u if da else -u) * ub * uc
                        gy += (u if db else -u) * ua * uc
                        gz += (u if dc else -u) * ua * ub
            there[p, axis] = new
            out[p, axis] = flip * (velocities[p, axis] + change) + keep * new
            affine[p, axis, 0] = keep * gx
            affine[p, axis, 1] = keep * gy
            affine[p, axis, 2] = keep * gz


def sample(points: np.ndarray, cells: Cells, faces: np.ndarray) -> np.ndarray:
    """Return the velocity ``(n, 3)`` at ``points`` ``(n, 3)`` in cells, trilinear between faces.

    Inactive faces are left out of the mean; where there are only those, the velocity is zero.
    """
    out = np.zeros_like(points)
    _sample_all(points, cells.table, cells.leaves, faces, out)
    return out


@njit(cache=True)
def _sample_all(points, table, leaves, faces, out):
    stencil = np.empty((3, 3, 3), dtype=np.int32)
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        i, j, k = int(x), int(y), int(z)
        whole = load_stencil(table, leaves, i, j, k, stencil)
        for axis in range(3):
            out[p, axis] = sample_face(x, y, z, i, j, k, axis, stencil, whole, faces)


@njit(cache=True, inline="always")
def sample_face(x, y, z, i, j, k, axis, stencil, whole, faces):
    """Return one velocity component at (x, y, z) in cell (i, j, k), see :func:`sample`.

    stencil, whole : results of :func:`load_stencil` for this cell.
    """
    a, b, c, wx, wy, wz = face_corner(x, y, z, i, j, k, axis)
    total, weight, one = np.float32(0), np.float32(0), np.float32(1)
    for da in range(2):
        ua = wx if da else one - wx
        for db in range(2):
            ub = ua * (wy if db else one - wy)
            for dc in range(2):
                n = stencil[a + da, b + db, c + dc]
                w = ub * (wz if dc else one - wz)
                if whole:
                    total += w * faces[n, axis]
                elif n >= 0:
                    total += w * faces[n, axis]
                    weight += w
    if whole:
        return total
    return total / weight if weight > 1e-6 else np.float32(0)
