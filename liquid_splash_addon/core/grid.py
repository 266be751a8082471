# SPDX-License-Identifier: GPL-3.0-or-later
"""The uniform grid: the one place that maps metres to cells and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

LOCAL_CELLS = 128
"""Cells along each side of the local box at full resolution."""

LOCAL_SPACING = 0.4 / LOCAL_CELLS
"""Edge of a cell of the full-resolution local grid, in metres."""


@dataclass(frozen=True)
class Grid:
    """A box of cubic cells.

    Attributes
    ----------
    shape : cells along x, y and z
    spacing : edge of a cell in metres
    origin : corner of the box with the smallest coordinates, metres
    """

    shape: tuple[int, int, int]
    spacing: float
    origin: tuple[float, float, float]

    @classmethod
    def local(cls, cells: int = LOCAL_CELLS) -> Grid:
        """Return the generator's box, centred on the origin, with ``cells`` cells a side."""
        size = LOCAL_CELLS * LOCAL_SPACING
        return cls((cells, cells, cells), size / cells, (-size / 2, -size / 2, -size / 2))

    @property
    def size(self) -> tuple[float, float, float]:
        """Edges of the box in metres."""
        x, y, z = (n * self.spacing for n in self.shape)
        return (x, y, z)

    def to_cells(self, points: npt.ArrayLike) -> np.ndarray:
        """Map metres ``(..., 3)`` to cell coordinates, in which cell i spans [i, i + 1)."""
        return (np.asarray(points) - np.asarray(self.origin)) / self.spacing

    def to_metres(self, cells: npt.ArrayLike) -> np.ndarray:
        """Map cell coordinates ``(..., 3)`` to metres; the inverse of :meth:`to_cells`."""
        return np.asarray(cells) * self.spacing + np.asarray(self.origin)

    def cell_of(self, points: npt.ArrayLike) -> np.ndarray:
        """Return the int64 indices ``(..., 3)`` of the cells that hold ``points`` (metres)."""
        return np.floor(self.to_cells(points)).astype(np.int64)

    def contains(self, points: npt.ArrayLike) -> np.ndarray:
        """Return a bool array ``(...)``: is each point (metres) inside the box?"""
        cells = self.cell_of(points)
        return np.asarray(((cells >= 0) & (cells < np.asarray(self.shape))).all(axis=-1))

    def centres(self) -> np.ndarray:
        """Return the cell centres in metres, float32 ``(X, Y, Z, 3)``."""
        axes = [self.origin[a] + (np.arange(self.shape[a]) + 0.5) * self.spacing for a in range(3)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).astype(np.float32)

    def crop(self, start: tuple[int, int, int], shape: tuple[int, int, int]) -> Grid:
        """Return the part that begins at cell ``start`` and has ``shape`` cells."""
        x, y, z = (o + i * self.spacing for o, i in zip(self.origin, start, strict=True))
        return Grid(shape, self.spacing, (x, y, z))
