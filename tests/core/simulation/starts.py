# SPDX-License-Identifier: GPL-3.0-or-later
"""Small starts of simulations."""

from __future__ import annotations

import numpy as np

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.level_set import LevelSet
from liquid_splash_addon.core.simulation.start import MovingObstacle, Start

CELLS = 40
"""Cells along each side of the splash's box, 0.4 m; ten millimetres each."""


def liquid(distance, velocity) -> LevelSet:
    """Return the liquid where a distance (metres, of points) is negative; m/s."""
    grid = Grid.local(CELLS)
    centres = grid.centres().astype(np.float64)
    level = np.clip(distance(centres) / grid.spacing, -4, 4).astype(np.float32)
    flow = np.broadcast_to(velocity(centres), centres.shape)
    near = (level < 4)[..., None]
    return LevelSet(level, np.ascontiguousarray(np.moveaxis(flow * near, -1, 0), np.float32), grid)


def ball(radius=0.05, centre=(0.0, 0.0, 0.0), speed=(0.0, 0.0, 0.0)) -> LevelSet:
    """Return a ball of liquid with one velocity."""
    return liquid(
        lambda points: np.linalg.norm(points - np.array(centre), axis=-1) - radius,
        lambda points: np.array(speed) + 1e-12,
    )


def crown(speed: float) -> LevelSet:
    """Return a thick ring whose wall leans outward and moves up and outward along itself."""
    slope = np.array([np.sin(0.5), np.cos(0.5)])  # outward, up

    def distance(points):
        around = np.hypot(points[..., 0], points[..., 1])
        offset = np.stack([around - 0.08, points[..., 2]], axis=-1)
        along = np.clip(offset @ slope, -0.06, 0.06)
        return np.linalg.norm(offset - along[..., None] * slope, axis=-1) - 0.015

    def velocity(points):
        around = np.maximum(np.hypot(points[..., 0], points[..., 1]), 1e-6)[..., None]
        outward = np.concatenate([points[..., :2] / around, 0 * around], axis=-1)
        return speed * (slope[0] * outward + slope[1] * np.array([0, 0, 1.0]))

    return liquid(distance, velocity)


def start(liquid, seconds=0.005, **others) -> Start:
    """Return the start of a simulation of a liquid, ``seconds`` a frame."""
    return Start(liquid, seconds, **others)


def moving(vertices, faces, way, frames) -> MovingObstacle:
    """Return a mesh that moves by ``way`` ``(3,)``, metres, in each of ``frames`` frames."""
    steps = np.arange(frames + 1)[:, None, None] * np.asarray(way, dtype=np.float64)
    return MovingObstacle((vertices[None] + steps).astype(np.float32), faces, "Mover")
