# SPDX-License-Identifier: GPL-3.0-or-later
"""Velocity from particles to faces and back (FLIP: Zhu and Bridson 2005; APIC: Jiang 2015)."""

from __future__ import annotations

import numpy as np
from numba import njit

from .cells import Cells, find


def particles_to_faces(
    positions: np.ndarray, velocities: np.ndarray, affine: np.ndarray, cells: Cells
) -> tuple[np.ndarray, np.ndarray]:
    """Return face velocities and weights, float32 ``(cells, 3)`` each.

    A face receives the weighted mean of ``v_p + C_p (x_face - x_p)`` with trilinear weights.

    positions ``(n, 3)``, velocities ``(n, 3)``, affine C ``(n, 3, 3)`` (1/s; zeros for pure
    FLIP), float32, sorted by cell for speed.
    """
    faces = np.zeros((len(cells.coordinates), 3), dtype=np.float32)
    weights = np.zeros_like(faces)
    _scatter(positions, velocities, affine, cells.table, cells.leaves, faces, weights)
    np.divide(faces, weights, out=faces, where=weights > 0)
    return faces, weights


def faces_to_particles(
    positions: np.ndarray,
    velocities: np.ndarray,
    cells: Cells,
    before: np.ndarray,
    after: np.ndarray,
    flip: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return new particle velocities ``(n, 3)`` and affine matrices ``(n, 3, 3)``.

    ``v <- flip (v + sample(after - before)) + (1 - flip) sample(after)``; the affine part is
    the gradient of the sampled velocity times ``1 - flip``, so that flip = 0 is APIC and
    flip = 1 is FLIP.

    before, after : face velocities ``(cells, 3)`` before and after the forces, extrapolated.
    """
    out = np.empty_like(velocities)
    affine = np.empty((len(positions), 3, 3), dtype=np.float32)
    table, leaves = cells.table, cells.leaves
    _gather(positions, velocities, table, leaves, before, after, np.float32(flip), out, affine)
    return out, affine


@njit(cache=True, inline="always")
def load_stencil(table, leaves, i, j, k, stencil):
    """Put the numbers of the 27 cells around (i, j, k) into ``stencil`` ``(3, 3, 3)``."""
    for a in range(3):
        for b in range(3):
            for c in range(3):
                stencil[a, b, c] = find(table, leaves, i + a - 1, j + b - 1, k + c - 1)


@njit(cache=True, inline="always")
def face_corner(x, y, z, i, j, k, axis):
    """Return where the 8 faces of ``axis`` around (x, y, z) begin, and the weights there.

    The corner is relative to cell (i, j, k) - 1, the weights are those of the upper faces.
    """
    fx = x - i + (1.0 if axis == 0 else 0.5)
    fy = y - j + (1.0 if axis == 1 else 0.5)
    fz = z - k + (1.0 if axis == 2 else 0.5)
    a, b, c = int(fx), int(fy), int(fz)
    return a, b, c, np.float32(fx - a), np.float32(fy - b), np.float32(fz - c)


@njit(cache=True, fastmath=True)
def _scatter(positions, velocities, affine, table, leaves, faces, weights):
    stencil = np.empty((3, 3, 3), dtype=np.int32)
    li, lj, lk = -9, -9, -9
    for p in range(len(positions)):
        x, y, z = positions[p, 0], positions[p, 1], positions[p, 2]
        i, j, k = int(x), int(y), int(z)
        if i != li or j != lj or k != lk:
            load_stencil(table, leaves, i, j, k, stencil)
            li, lj, lk = i, j, k
        for axis in range(3):
            a, b, c, wx, wy, wz = face_corner(x, y, z, i, j, k, axis)
            v = velocities[p, axis]
            cx, cy, cz = affine[p, axis, 0], affine[p, axis, 1], affine[p, axis, 2]
            for da in range(2):
                ua = wx if da else 1 - wx
                for db in range(2):
                    ub = ua * (wy if db else 1 - wy)
                    for dc in range(2):
                        w = ub * (wz if dc else 1 - wz)
                        n = stencil[a + da, b + db, c + dc]
                        faces[n, axis] += w * (v + cx * (da - wx) + cy * (db - wy) + cz * (dc - wz))
                        weights[n, axis] += w


@njit(cache=True, fastmath=True)
def _gather(positions, velocities, table, leaves, before, after, flip, out, affine):
    stencil = np.empty((3, 3, 3), dtype=np.int32)
    li, lj, lk = -9, -9, -9
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
                ua = wx if da else 1 - wx
                for db in range(2):
                    ub = wy if db else 1 - wy
                    for dc in range(2):
                        uc = wz if dc else 1 - wz
                        n = stencil[a + da, b + db, c + dc]
                        u = after[n, axis]
                        w = ua * ub * uc
                        new += w * u
                        change += w * (u - before[n, axis])
                        gx += (u if da else -u) * ub * uc
                        gy += (u if db else -u) * ua * uc
                        gz += (u if dc else -u) * ua * ub
            out[p, axis] = flip * (velocities[p, axis] + change) + (1 - flip) * new
            affine[p, axis, 0] = (1 - flip) * gx
            affine[p, axis, 1] = (1 - flip) * gy
            affine[p, axis, 2] = (1 - flip) * gz


def sample(points: np.ndarray, cells: Cells, faces: np.ndarray) -> np.ndarray:
    """Return the velocity ``(n, 3)`` at ``points`` ``(n, 3)`` (cells), trilinearly from faces.

    Faces that are not active are left out of the mean; where none is, velocity is zero.
    """
    out = np.zeros_like(points)
    _sample_all(points, cells.table, cells.leaves, faces, out)
    return out


@njit(cache=True)
def _sample_all(points, table, leaves, faces, out):
    stencil = np.empty((3, 3, 3), dtype=np.int32)
    for p in range(len(points)):
        i, j, k = int(points[p, 0]), int(points[p, 1]), int(points[p, 2])
        load_stencil(table, leaves, i, j, k, stencil)
        for axis in range(3):
            out[p, axis] = sample_face(
                points[p, 0], points[p, 1], points[p, 2], i, j, k, axis, stencil, faces
            )


@njit(cache=True, inline="always")
def sample_face(x, y, z, i, j, k, axis, stencil, faces):
    """Return one velocity component at (x, y, z) in cell (i, j, k), see :func:`sample`."""
    a, b, c, wx, wy, wz = face_corner(x, y, z, i, j, k, axis)
    total, weight = np.float32(0), np.float32(0)
    for da in range(2):
        ua = wx if da else 1 - wx
        for db in range(2):
            ub = ua * (wy if db else 1 - wy)
            for dc in range(2):
                n = stencil[a + da, b + db, c + dc]
                if n >= 0:
                    w = ub * (wz if dc else 1 - wz)
                    total += w * faces[n, axis]
                    weight += w
    return total / weight if weight > 1e-6 else np.float32(0)
