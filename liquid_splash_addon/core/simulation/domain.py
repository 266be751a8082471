# SPDX-License-Identifier: GPL-3.0-or-later
"""The box that is simulated: a cube of cells with z up, wherever the splash's own axes point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fluid.step import OPEN_MARGIN
from ..liquid.level_set import LevelSet
from .settings import SimulationSettings
from .start import Start

MOST_CELLS = 2000
"""Cells along each side of a domain: beyond, single precision is too coarse for positions."""

BELOW_GROUND = 8.0
"""Cells of the domain below the ground."""


@dataclass(frozen=True)
class Domain:
    """Where the cells lie in the splash's local space.

    Attributes
    ----------
    turn : float64 ``(3, 3)``, rows are the domain's axes in local space; the third is up
    corner : float64 ``(3,)``, its lowest corner along these axes, metres
    cell : edge of a cell, metres
    cells : along each side, the margin in which liquid is dropped included
    """

    turn: np.ndarray
    corner: np.ndarray
    cell: float
    cells: int

    def to_cells(self, points: np.ndarray) -> np.ndarray:
        """Map local metres ``(..., 3)`` to cells."""
        return np.asarray((points @ self.turn.T - self.corner) / self.cell)

    def to_local(self, cells: np.ndarray) -> np.ndarray:
        """Map cells ``(..., 3)`` to local metres."""
        return np.asarray((cells * self.cell + self.corner) @ self.turn)

    def vectors_to_cells(self, vectors: np.ndarray) -> np.ndarray:
        """Map local velocities ``(..., 3)``, m/s, to cells per second."""
        return np.asarray(vectors @ self.turn.T / self.cell)

    def vectors_to_local(self, vectors: np.ndarray) -> np.ndarray:
        """Map velocities ``(..., 3)`` in cells per second to local m/s."""
        return np.asarray(vectors * self.cell @ self.turn)


def domain_of(start: Start, settings: SimulationSettings, cell: float) -> Domain:
    """Return the domain of a simulation: the splash, its ground, and the margin around them.

    cell : edge of a cell, metres. ValueError, with a sentence for the user, where the domain is
    too large or there is no liquid.
    """
    turn = upright(start.up)
    low, high = bounds_along(turn, start)
    room = settings.margin * float((high - low).max())
    low, high = low - room, high + room
    if settings.ground != "NONE":
        low[2] = start.ground - BELOW_GROUND * cell
        high[2] = max(high[2], start.ground + room)
    side = float((high - low).max())
    inner = int(np.ceil(side / cell))
    if inner > MOST_CELLS:
        raise ValueError(
            f"Lower Resolution or Margin, or move the ground nearer: the domain would be {inner} "
            f"voxels wide, {MOST_CELLS} at most"
        )
    middle = (low + high) / 2
    corner = middle - (inner / 2 + OPEN_MARGIN) * cell
    if settings.ground != "NONE":  # the domain reaches upwards from its ground
        corner[2] = low[2] - OPEN_MARGIN * cell
    return Domain(
        turn, aligned(corner, turn, cell, start, settings), cell, inner + 2 * int(OPEN_MARGIN)
    )


def cell_of(liquid: LevelSet, settings: SimulationSettings) -> float:
    """Return the edge of a cell, metres."""
    return max(liquid.grid.size) / settings.cells


def aligned(
    corner: np.ndarray, turn: np.ndarray, cell: float, start: Start, settings: SimulationSettings
) -> np.ndarray:
    """Return the corner moved by less than a cell: cells meet the ground, and the splash's own.

    A still pool lies between layers of cells, where it stays still.
    """
    anchor = turn @ np.asarray(start.liquid.grid.origin)
    if settings.ground != "NONE":
        anchor[2] = start.ground
    return np.asarray(anchor - np.ceil((anchor - corner) / cell) * cell)


def upright(up: np.ndarray) -> np.ndarray:
    """Return axes (rows) of which the third is ``up``; the first is near one of the local axes."""
    up = np.asarray(up, dtype=np.float64)
    size = np.linalg.norm(up)
    if not np.isfinite(size) or size < 1e-9:
        raise ValueError("The direction of gravity is unknown: give the splash a valid rotation")
    up = up / size
    first = np.eye(3)[int(np.argmin(np.abs(up)))]
    first = first - (first @ up) * up
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(up, first), up])


def bounds_along(turn: np.ndarray, start: Start) -> tuple[np.ndarray, np.ndarray]:
    """Return least and greatest coordinates of the liquid and the drops, metres along the axes."""
    liquid = start.liquid
    inside = liquid.level < 0
    points = [np.zeros((0, 3))]
    if inside.any():
        points.append(liquid.grid.to_metres(np.argwhere(inside) + 0.5))
    if len(start.drops.positions):
        points.append(start.drops.positions.astype(np.float64))
    together = np.concatenate(points) @ turn.T
    if not len(together):
        raise ValueError("The splash has no liquid to simulate: lower its Thinness")
    half = liquid.grid.spacing / 2
    return together.min(axis=0) - half, together.max(axis=0) + half
