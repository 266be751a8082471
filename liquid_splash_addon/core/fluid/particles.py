# SPDX-License-Identifier: GPL-3.0-or-later
"""The particles that carry the liquid."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiling import njit


class Particles(NamedTuple):
    """Points that each represent a small volume of liquid; float32, lengths in cells.

    Attributes
    ----------
    positions : ``(n, 3)``
    velocities : ``(n, 3)``, cells per second
    affine : ``(n, 3, 3)``, gradient of the velocity around each (APIC's C), 1/s
    volumes : ``(n,)``, cells^3; transfer weights particles by it
    stretch : ``(n, 3, 3)``, left Cauchy-Green tensor: how far the liquid around each particle has
        been stretched since it was last evenly sampled (identity: not at all)
    """

    positions: np.ndarray
    velocities: np.ndarray
    affine: np.ndarray
    volumes: np.ndarray
    stretch: np.ndarray

    @classmethod
    def moving(cls, positions: np.ndarray, velocity: np.ndarray, volume: float) -> Particles:
        """Return particles at ``positions`` ``(n, 3)`` that share one velocity ``(3,)``.

        volume : of each particle, cells^3.
        """
        count = len(positions)
        return cls(
            positions.astype(np.float32),
            np.tile(velocity.astype(np.float32), (count, 1)),
            np.zeros((count, 3, 3), dtype=np.float32),
            np.full(count, volume, dtype=np.float32),
            np.tile(np.eye(3, dtype=np.float32), (count, 1, 1)),
        )

    @classmethod
    def joined(cls, *parts: Particles) -> Particles:
        """Return the particles of all ``parts``, in their order."""
        return cls(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))

    def speed_limit(self, share: float = 0.001) -> float:
        """Return the speed that ``share`` of the particles exceed, cells/s; 0 without particles."""
        if not len(self.velocities):
            return 0.0
        return float(np.sqrt(np.quantile(_squares(self.velocities), 1 - share)))

    def within(self, low: float, high: float) -> np.ndarray:
        """Return which particles have all coordinates between ``low`` and ``high``, bool ``(n,)``.

        NaN counts as outside.
        """
        return np.asarray(_within(self.positions, np.float32(low), np.float32(high)))

    def take(self, which: np.ndarray) -> Particles:
        """Return the particles that ``which`` (numbers or a bool mask) picks."""
        return Particles(*(array[which] for array in self))


# Reductions along a short last axis are ten times slower in NumPy.
@njit(cache=True)
def _squares(vectors):
    out = np.empty(len(vectors), dtype=np.float32)
    for p in range(len(vectors)):
        out[p] = vectors[p, 0] ** 2 + vectors[p, 1] ** 2 + vectors[p, 2] ** 2
    return out


@njit(cache=True)
def _within(positions, low, high):
    inside = np.empty(len(positions), dtype=np.bool_)
    for p in range(len(positions)):
        x, y, z = positions[p, 0], positions[p, 1], positions[p, 2]
        inside[p] = low < x < high and low < y < high and low < z < high
    return inside
