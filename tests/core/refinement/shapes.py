# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquids with a known shape and flow, for the tests of refinement."""

from __future__ import annotations

import numpy as np

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.level_set import LevelSet

CELLS = 48
GRID = Grid((CELLS,) * 3, 0.003125, (-0.075, -0.075, -0.075))


def liquid_of(distance: np.ndarray, velocity: np.ndarray) -> LevelSet:
    """Return the liquid of a signed distance (cells); velocity ``(3,)`` or ``(3, X, Y, Z)``."""
    flow = np.zeros((3, *GRID.shape), dtype=np.float32)
    flow[:] = np.reshape(velocity, (3, 1, 1, 1)) if np.ndim(velocity) == 1 else velocity
    flow[:, distance > 3] = 0
    return LevelSet(np.clip(distance, -3, 3).astype(np.float32), flow, GRID)


def offsets() -> np.ndarray:
    """Return each cell's place relative to the middle of the grid, cells ``(3, X, Y, Z)``."""
    return np.moveaxis(GRID.centres(), -1, 0) / GRID.spacing


def ball(radius: float, velocity=(0.0, 0.0, 0.0)) -> LevelSet:
    """Return a ball in the middle, radius in cells."""
    return liquid_of(np.linalg.norm(offsets(), axis=0) - radius, np.asarray(velocity))


def sheet(speed: float = 1.5, thick: float = 3.0) -> LevelSet:
    """Return a square sheet in the xz plane that rises with ``speed`` m/s and sways across."""
    x, y, z = offsets()
    distance = np.maximum(np.maximum(np.abs(y) - thick / 2, np.abs(x) - 14), np.abs(z + 6) - 10)
    sway = 0.4 * np.sin(0.9 * x) * np.sin(0.7 * z)
    flow = np.stack([0 * x, sway, speed + 0.3 * np.cos(1.1 * x)])
    return liquid_of(distance, flow)
