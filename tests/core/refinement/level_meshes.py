# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of known shapes, made as those of splashes are: marching cubes, then smoothing."""

from __future__ import annotations

import numpy as np
from skimage.measure import marching_cubes

from liquid_splash_addon.core.mesh.mesh import Mesh
from liquid_splash_addon.core.mesh.taubin import taubin_smoothed

CELL = 0.004
"""Edge of a grid cell, metres."""


def mesh_of(level, half):
    """Return the mesh of ``level(x, y, z)`` (cells, negative inside) in a box of +-half cells.

    Velocities are the vertices times 10 / s.
    """
    axes = np.arange(-half, half) + 0.5
    field = np.clip(level(*np.meshgrid(axes, axes, axes, indexing="ij")), -3, 3)
    vertices, faces, _, _ = marching_cubes(field, 0.0, gradient_direction="descent")
    points = ((taubin_smoothed(vertices, faces) - half + 0.5) * CELL).astype(np.float32)
    return Mesh(points, faces.astype(np.int32), 10 * points)


def planet(half=24):
    """Return a ball of 10 cells with a sheet around it, two cells thick, 20 cells in radius."""

    def level(x, y, z):
        ball = np.sqrt(x**2 + y**2 + z**2) - 10
        radius = np.hypot(x, y)
        sheet = np.hypot(np.maximum(radius - 20, 0), z) - 1
        return np.minimum(ball, sheet)

    return mesh_of(level, half)


def bowl(half=26):
    """Return a thin bowl with a wavy rim, and drops of 1 to 3 cells above it."""

    def level(x, y, z):
        radius, angle = np.hypot(x, y), np.arctan2(y, x)
        top = 10 + 3 * np.sin(5 * angle)
        share = np.clip((z + 16) / 26, 0, 1.5)
        wall = 8 + 12 * share**1.5
        tip = 8 + 12 * np.clip((top + 16) / 26, 0, 1.5) ** 1.5
        sheet = np.abs(radius - wall) / np.sqrt(1 + (18 / 26) ** 2 * share) - 1.1
        sheet = np.maximum(sheet, np.maximum(z - top, -18 - z))
        rim = np.hypot(radius - tip, z - top) - 1.8
        pool = np.maximum(radius - 9.5, np.abs(z + 18) - 2.5)
        drops = [
            np.sqrt((x - 12 * np.cos(n)) ** 2 + (y - 12 * np.sin(n)) ** 2 + (z - 20) ** 2) - size
            for n, size in ((0, 1.0), (2, 2.0), (4, 3.0))
        ]
        return np.minimum.reduce([sheet, rim, pool, *drops])

    return mesh_of(level, half)


def prism(length, width):
    """Return a sheet along x, two cells thick; its surface is flat but for being rolled up.

    length, width : cells
    """
    half = length // 2

    def level(x, y, z):
        rolled = np.hypot(np.maximum(np.abs(y) - width / 2, 0), z) - 1
        return np.maximum(rolled, np.abs(x) - half + 2)

    return mesh_of(level, half)
