# SPDX-License-Identifier: GPL-3.0-or-later
"""The liquid that refinement works on: the very level that is meshed, and its velocity."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

from ..fluid.streamlines import velocity_at
from ..fluid.surface import redistance
from ..grid import Grid
from ..mesh.marching_cubes import filled, liquid_box, probability, surface_level
from .fields import AIR, Fields

FLOW = 4
"""Cells around the liquid's box in which velocity is looked for too: some is known there."""


@dataclass(frozen=True)
class Liquid:
    """A splash as a level set.

    Attributes
    ----------
    level : float32 ``(X, Y, Z)``, cells, negative in the liquid; its zero is what is meshed
    velocity : float32 ``(3, X, Y, Z)``, m/s, known in the liquid and about 3 cells beyond
    grid : where the cells lie, metres
    """

    level: np.ndarray
    velocity: np.ndarray
    grid: Grid

    @classmethod
    def of(cls, fields: Fields, threshold: float = 0.5) -> Liquid:
        """Return the liquid whose surface is where the probability is ``threshold``."""
        return cls(surface_level(fields, threshold), fields.velocity, fields.grid)

    @cached_property
    def box(self) -> tuple[slice, slice, slice] | None:
        """The part of the grid that holds liquid, 4 cells wider; None without liquid."""
        return liquid_box(self.level)

    @cached_property
    def distance(self) -> np.ndarray:
        """Signed distance to the surface in cells, float32 ``(X, Y, Z)``, clipped at +-AIR.

        The level itself is steep where the generator was sure and flat where it was not.
        """
        out = np.full(self.level.shape, AIR, dtype=np.float32)
        box = self.box
        if box is not None:
            # Air around, so that the sweep's outermost cells are none of the liquid's.
            padded = np.pad(np.clip(self.level[box], -AIR, AIR), 1, constant_values=AIR)
            out[box] = redistance(padded, AIR)[1:-1, 1:-1, 1:-1]
        return out

    def flow_at(self, positions: np.ndarray, instead: np.ndarray | None = None) -> np.ndarray:
        """Return the velocity at ``positions`` ``(n, 3)`` (cells), cells per second.

        Where it is not known, so far from the liquid, it is that at ``instead`` ``(n, 3)``, or 0.
        """
        out = np.zeros((len(positions), 3))
        other = positions if instead is None else instead
        flow, corner = self._flow_last
        _flow(flow, positions - corner, other - corner, out)
        return out / self.grid.spacing

    @cached_property
    def _flow_last(self) -> tuple[np.ndarray, np.ndarray]:
        """Velocity around the liquid with its components last, and where that begins, cells.

        ``(x, y, z, 3)``: one place in memory a cell. The outermost cells know none.
        """
        box = wider(self.box or (slice(0, 1),) * 3, FLOW)
        near = np.moveaxis(self.velocity[(slice(None), *box)], 0, -1)
        corner = np.array([side.start - 1.0 for side in box])
        return np.pad(near, ((1, 1), (1, 1), (1, 1), (0, 0))), corner

    @property
    def volume(self) -> float:
        """Volume in cells; a cell cut by the surface counts in part."""
        box = self.box
        return 0.0 if box is None else filled(self.level[box])

    def fields(self) -> Fields:
        """Return fields whose surface, at a threshold of 0.5, is this liquid's."""
        distance = np.clip(self.level, -AIR, AIR)
        return Fields(probability(self.level), distance, self.velocity, self.grid)


@njit(cache=True)
def _flow(field, positions, instead, out):
    for p in range(len(positions)):
        x, y, z = positions[p]
        if velocity_at(field, x, y, z, out[p]) == 0.0:
            x, y, z = instead[p]
            velocity_at(field, x, y, z, out[p])


def slope(distance: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return the unit gradient of ``distance`` at inner ``cells`` ``(n, 3)``, ``(n, 3)``."""
    columns = []
    for step in np.eye(3, dtype=int):
        ahead, behind = cells + step, cells - step
        columns.append(distance[tuple(ahead.T)] - distance[tuple(behind.T)])
    gradient = np.stack(columns, axis=1)
    return np.asarray(gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-6))


def wider(box: tuple[slice, ...], margin: int) -> tuple[slice, ...]:
    """Return a box that begins and ends ``margin`` cells farther out, if the grid does."""
    return tuple(slice(max(side.start - margin, 0), side.stop + margin) for side in box)
