# SPDX-License-Identifier: GPL-3.0-or-later
"""A volumetric splash: occupancy, signed distance and velocity on one grid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..compiling import njit
from ..grid import Grid
from ..scale import Scale

PHI_CELLS = 4.0
"""Cells over which phi falls from 1 to 0, so that Table 2's phi_band = 0.4 is 1.6 cells."""

AIR = 3.0
"""Distance, in cells, that stands for "far from liquid"."""

NEAREST = 0.1
"""Least distance of a cell to the surface, in cells: each cell is on one side of it."""


@dataclass(frozen=True)
class Fields:
    """A volumetric splash in the local frame.

    Attributes
    ----------
    occupancy : float32 ``(X, Y, Z)``, probability of liquid, 0..1; the surface is at 0.5
    distance : float32 ``(X, Y, Z)``, signed distance in cells, negative in the liquid, +-AIR
    velocity : float32 ``(3, X, Y, Z)``, m/s; zero far from the liquid
    grid : where the cells lie, metres
    """

    occupancy: np.ndarray
    distance: np.ndarray
    velocity: np.ndarray
    grid: Grid

    @property
    def phi(self) -> np.ndarray:
        """The paper's scalar field (eq. 4): 1 in the liquid, 0 in the air, 0.5 at the surface."""
        return np.asarray(np.clip(0.5 - self.distance / PHI_CELLS, 0.0, 1.0))

    def seen_through(self, model: Scale) -> Fields:
        """Return the liquid of which this is the model.

        model : how the liquid's metres and seconds are measured here
        """
        spacing, *origin = (
            model.lengths_to_drawing(v) for v in (self.grid.spacing, *self.grid.origin)
        )
        x, y, z = origin
        velocity = model.velocities_to_drawing(self.velocity).astype(np.float32)
        return replace(self, velocity=velocity, grid=Grid(self.grid.shape, spacing, (x, y, z)))

    def round_off(self) -> Fields:
        """Return the fields as they come back from :meth:`to_arrays`.

        What is made of these now can be made again, exactly, from a saved file.
        """
        near = self.distance < AIR  # a few cells in a hundred
        distance = np.full_like(self.distance, AIR)
        distance[near] = self.distance[near].astype(np.float16)
        velocity = np.zeros_like(self.velocity)
        velocity[:, near] = self.velocity[:, near].astype(np.float16)
        return Fields(_rounded_shares(self.occupancy), distance, velocity, self.grid)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return what is stored of the fields, by name, see :meth:`from_arrays`.

        Occupancy keeps 8 bits, distance and velocity 16; velocity is kept near the liquid.
        """
        near = self.distance < AIR
        return {
            "occupancy": np.round(self.occupancy * 255).astype(np.uint8),
            **pack_near(near, self.grid),
            "distance": self.distance[near].astype(np.float16),
            "velocity": self.velocity[:, near].astype(np.float16),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> Fields:
        """Return the fields of which :meth:`to_arrays` stored these.

        Raises ValueError or KeyError if they are no such arrays.
        """
        near, grid = unpack_near(arrays)
        distance = np.full(grid.shape, AIR, dtype=np.float32)
        distance[near] = arrays["distance"]
        velocity = np.zeros((3, *grid.shape), dtype=np.float32)
        velocity[:, near] = arrays["velocity"]
        occupancy = (arrays["occupancy"].astype(np.float32) / 255).reshape(grid.shape)
        return cls(occupancy, distance, velocity, grid)


def pack_near(near: np.ndarray, grid: Grid) -> dict[str, np.ndarray]:
    """Return what is stored of a grid and of which of its cells are kept, bool ``(X, Y, Z)``."""
    return {
        "near": np.packbits(near),
        "shape": np.array(grid.shape),
        "placing": np.array([grid.spacing, *grid.origin]),
    }


def unpack_near(arrays: Mapping[str, np.ndarray]) -> tuple[np.ndarray, Grid]:
    """Return the kept cells and the grid of :func:`pack_near`."""
    x, y, z = (int(n) for n in arrays["shape"])
    spacing, a, b, c = (float(value) for value in arrays["placing"])
    near = np.unpackbits(arrays["near"], count=x * y * z).astype(bool).reshape(x, y, z)
    return near, Grid((x, y, z), spacing, (a, b, c))


def clip_to_band(
    occupancy: np.ndarray,
    distance: np.ndarray,
    velocity: np.ndarray,
    grid: Grid,
    reach: float = AIR,
    start: tuple[int, int, int] = (0, 0, 0),
) -> Fields:
    """Return Fields whose parts agree, clipped to the band that is known: occupancy decides.

    The distance keeps the sign of 0.5 - occupancy, at least NEAREST from the surface, and the
    velocity ends where the distance does.

    reach : greatest distance that is known, cells; start : the cell of ``grid`` at which the
    arrays begin; where they cover a part of it, the rest is air.
    """
    shape = grid.shape
    fields = Fields(
        np.zeros(shape, np.float32), np.full(shape, AIR, np.float32),
        np.zeros((3, *shape), np.float32), grid,
    )  # fmt: skip
    known = map(np.ascontiguousarray, (occupancy, distance, velocity))  # one layout to compile for
    _clip_to_band(
        *known, np.float32(reach), start, fields.occupancy, fields.distance, fields.velocity
    )
    return fields


@njit(cache=True)
def _clip_to_band(
    occupancy: np.ndarray,
    distance: np.ndarray,
    velocity: np.ndarray,
    reach: np.float32,
    start: tuple[int, int, int],
    shares: np.ndarray,
    distances: np.ndarray,
    velocities: np.ndarray,
) -> None:
    """Write the first three arrays into the last three from ``start`` on, made to agree."""
    nearest = np.float32(NEAREST)
    x, y, z = start
    for i in range(occupancy.shape[0]):
        for j in range(occupancy.shape[1]):
            for k in range(occupancy.shape[2]):
                shares[x + i, y + j, z + k] = occupancy[i, j, k]
                away = min(max(distance[i, j, k], -reach), reach)
                if occupancy[i, j, k] > 0.5:
                    away = min(away, -nearest)
                else:
                    away = max(away, nearest)
                if away < reach - 0.01:
                    distances[x + i, y + j, z + k] = away
                    for a in range(3):
                        velocities[a, x + i, y + j, z + k] = velocity[a, i, j, k]


def _rounded_shares(occupancy: np.ndarray) -> np.ndarray:
    """Return probabilities rounded to 255ths."""
    rounded = np.zeros(occupancy.shape, dtype=np.float32)
    _round_shares(np.ascontiguousarray(occupancy).ravel(), rounded.ravel())
    return rounded


@njit(cache=True)
def _round_shares(occupancy: np.ndarray, rounded: np.ndarray) -> None:
    """Write probabilities, rounded to 255ths, where they are not 0."""
    most = np.float32(255)
    for i in range(len(occupancy)):
        if occupancy[i] != 0:
            rounded[i] = np.float32(np.rint(occupancy[i] * most)) / most
