# SPDX-License-Identifier: GPL-3.0-or-later
"""The liquid that refinement works on: the very level that is meshed, and its velocity."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

from ..fields import AIR, Fields
from ..fluid.streamlines import velocity_at
from ..fluid.surface import redistance
from ..grid import Grid
from ..meshing import surface_level


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
    def distance(self) -> np.ndarray:
        """Signed distance to the surface in cells, float32 ``(X, Y, Z)``, clipped at +-AIR.

        The level itself is steep where the generator was sure and flat where it was not.
        """
        out = np.full(self.level.shape, AIR, dtype=np.float32)
        box = liquid_box(self.level)
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
        _flow(self._flow_last, positions.astype(np.float64), other.astype(np.float64), out)
        return out / self.grid.spacing

    @cached_property
    def _flow_last(self) -> np.ndarray:
        """Velocity with its components last, ``(X, Y, Z, 3)``: one place in memory a cell."""
        return np.ascontiguousarray(np.moveaxis(self.velocity, 0, -1))

    @property
    def volume(self) -> float:
        """Volume in cells; a cell cut by the surface counts in part."""
        return float(np.clip(0.5 - self.level, 0, 1).sum())

    def fields(self) -> Fields:
        """Return fields whose surface, at a threshold of 0.5, is this liquid's."""
        occupancy = 1 / (1 + np.exp(2 * np.clip(self.level, -10, 10)))
        distance = np.clip(self.level, -AIR, AIR)
        return Fields(occupancy.astype(np.float32), distance, self.velocity, self.grid)


@njit(cache=True)
def _flow(field, positions, instead, out):
    for p in range(len(positions)):
        x, y, z = positions[p]
        if velocity_at(field, x, y, z, out[p]) == 0.0:
            x, y, z = instead[p]
            velocity_at(field, x, y, z, out[p])


def liquid_box(level: np.ndarray, margin: int = 4) -> tuple[slice, slice, slice] | None:
    """Return the part of a grid that holds liquid, ``margin`` cells wider; None without liquid."""
    inside = level < 0
    if not inside.any():
        return None
    parts = []
    for axis in range(3):
        rows = np.flatnonzero(inside.any(axis=tuple(a for a in range(3) if a != axis)))
        parts.append(slice(max(int(rows[0]) - margin, 0), int(rows[-1]) + 1 + margin))
    return (parts[0], parts[1], parts[2])
