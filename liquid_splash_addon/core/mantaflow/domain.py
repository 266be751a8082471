# SPDX-License-Identifier: GPL-3.0-or-later
"""The box in the world that Mantaflow simulates: whole cubic cells along the world's axes."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from ..animation.solver_start import SolverStart
from ..grid import Grid
from .settings import BYTES_PER_CELL, MantaflowSettings

WALL = 1
"""Cells at each side of the domain that Mantaflow makes a wall, or the way out where it is open."""

LEAST_ROOM = 3
"""Cells between the liquid and a side of the domain, the wall included."""

MOST_SHARE = 0.8
"""Share of the free memory that a domain may be estimated to need."""

TIME_UNIT = 0.4
"""Seconds in a unit of Mantaflow's time; its velocities are in cells a unit (measured)."""


class DomainError(ValueError):
    """No domain can be made; the message says what to do."""


@dataclass(frozen=True)
class Domain:
    """A box of cells in the world.

    Attributes
    ----------
    shape : cells along x, y and z
    cell : edge of a cell, Blender units
    corner : float64 ``(3,)``, the lowest corner in the world
    """

    shape: tuple[int, int, int]
    cell: float
    corner: np.ndarray

    @classmethod
    def around(cls, start: SolverStart, settings: MantaflowSettings) -> Domain:
        """Return the domain of a splash: its box, the margin, and the ground where there is one.

        Raises DomainError where the liquid does not fit above its ground.
        """
        low, high = bounds(start)
        longest = float((high - low).max())
        margin = settings.margin * longest
        if settings.ground == "NONE":
            return cls.between(low - margin, high + margin, settings.resolution)
        below = settings.ground_height
        bottom = below - (settings.pool_depth if settings.ground == "POOL" else 0.0)
        if high[2] <= bottom:
            raise DomainError(
                "The splash lies below the ground: lower Height, or move the splash up"
            )
        outer = np.array([*(low[:2] - margin), bottom]), np.maximum(high, below) + margin
        domain = cls.between(*outer, settings.resolution)
        # The bottom of the liquid is the top of the wall.
        corner = domain.corner.copy()
        corner[2] = bottom - WALL * domain.cell
        x, y, z = domain.shape
        return cls((x, y, z + WALL), domain.cell, corner)

    @classmethod
    def between(cls, low: np.ndarray, high: np.ndarray, resolution: int) -> Domain:
        """Return the box between two corners, with ``resolution`` cells along its longest side.

        Whole cells with room for walls; the middle stays where it is.
        """
        size = high - low
        cell = float(size.max()) / max(resolution - 2 * LEAST_ROOM, 4)
        shape = np.maximum(np.ceil(size / cell - 1e-6).astype(int) + 2 * LEAST_ROOM, 8)
        corner = (low + high) / 2 - shape * cell / 2
        return cls((int(shape[0]), int(shape[1]), int(shape[2])), cell, corner)

    @property
    def size(self) -> np.ndarray:
        """Edges of the box, Blender units ``(3,)``."""
        return np.array(self.shape) * self.cell

    @property
    def middle(self) -> np.ndarray:
        """Its middle in the world ``(3,)``."""
        return self.corner + self.size / 2

    @property
    def longest(self) -> int:
        """Cells along the longest side: Mantaflow's resolution."""
        return max(self.shape)

    @property
    def grid(self) -> Grid:
        """The cells, in Blender units."""
        x, y, z = (float(value) for value in self.corner)
        return Grid(self.shape, self.cell, (x, y, z))

    @property
    def memory(self) -> int:
        """Bytes that Mantaflow is estimated to need."""
        return BYTES_PER_CELL * int(np.prod(self.shape))


def bounds(start: SolverStart) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners ``(3,)`` of the box of a start's liquid and drops in the world."""
    found = []
    if start.liquid.box is not None:
        wet = np.argwhere(start.liquid.level < 0)
        ends = start.liquid.grid.to_metres(wet + 0.5)
        placed = start.world.points_to_drawing(ends)
        found += [placed - start.cell / 2, placed + start.cell / 2]
    if len(start.drops.radii):
        centres = start.world.points_to_drawing(start.drops.positions.astype(np.float64))
        radii = start.world.scale.lengths_to_drawing(start.drops.radii.astype(np.float64))[:, None]
        found += [centres - radii, centres + radii]
    points = np.concatenate(found)
    return points.min(axis=0), points.max(axis=0)


def check_memory(domain: Domain, free: int | None = None) -> None:
    """Raise DomainError if a domain would need more memory than is there.

    free : bytes; by default what :func:`free_memory` finds.
    """
    free = free_memory() if free is None else free
    if free and domain.memory > MOST_SHARE * free:
        fits = int(domain.longest * (MOST_SHARE * free / domain.memory) ** (1 / 3))
        raise DomainError(
            f"A domain of {domain.shape[0]} x {domain.shape[1]} x {domain.shape[2]} voxels would "
            f"need about {domain.memory / 2**30:.1f} GB, and {free / 2**30:.1f} GB are free: set "
            f"Resolution to {fits} or less, or lower Margin"
        )


def free_memory() -> int:
    """Return the bytes of memory that are free; 0 where that is not known."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            for line in file:
                if line.startswith("MemAvailable:"):
                    return 1024 * int(line.split()[1])
    except (OSError, ValueError, IndexError):
        pass
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):  # Windows
        return 0
