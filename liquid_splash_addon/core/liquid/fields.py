# SPDX-License-Identifier: GPL-3.0-or-later
"""A volumetric splash: occupancy, signed distance and velocity on one grid."""

from __future__ import annotations

import io
import zlib
from dataclasses import dataclass
from zipfile import BadZipFile

import numpy as np
from numba import njit

from ..grid import Grid

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

    def round_off(self) -> Fields:
        """Return the fields as they come back from :meth:`to_bytes`.

        What is made of these now can be made again, exactly, from a saved file.
        """
        near = self.distance < AIR  # a few cells in a hundred
        distance = np.full_like(self.distance, AIR)
        distance[near] = self.distance[near].astype(np.float16)
        velocity = np.zeros_like(self.velocity)
        velocity[:, near] = self.velocity[:, near].astype(np.float16)
        return Fields(_rounded_shares(self.occupancy), distance, velocity, self.grid)

    def to_bytes(self) -> bytes:
        """Return a compressed copy (a megabyte or two), see :meth:`from_bytes`.

        Occupancy keeps 8 bits, distance and velocity 16; velocity is kept near the liquid.
        """
        near = self.distance < AIR
        buffer = io.BytesIO()
        np.savez_compressed(
            buffer,
            occupancy=np.round(self.occupancy * 255).astype(np.uint8),
            near=np.packbits(near),
            distance=self.distance[near].astype(np.float16),
            velocity=self.velocity[:, near].astype(np.float16),
            shape=np.array(self.grid.shape),
            placing=np.array([self.grid.spacing, *self.grid.origin]),
        )
        return buffer.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes) -> Fields:
        """Return the fields stored by :meth:`to_bytes`; ValueError if ``data`` is no such thing."""
        try:
            with np.load(io.BytesIO(data), allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
            shape = tuple(int(n) for n in arrays["shape"])
            spacing, *origin = (float(value) for value in arrays["placing"])
            count = int(np.prod(shape))
            near = np.unpackbits(arrays["near"], count=count).astype(bool).reshape(shape)
            distance = np.full(shape, AIR, dtype=np.float32)
            distance[near] = arrays["distance"]
            velocity = np.zeros((3, *shape), dtype=np.float32)
            velocity[:, near] = arrays["velocity"]
        except (ValueError, KeyError, EOFError, OSError, BadZipFile, zlib.error) as error:
            raise ValueError("these bytes are no stored splash: generate it again") from error
        occupancy = arrays["occupancy"].astype(np.float32) / 255
        grid = Grid((shape[0], shape[1], shape[2]), spacing, (origin[0], origin[1], origin[2]))
        return cls(occupancy, distance, velocity, grid)


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
    box = tuple(slice(i, i + n) for i, n in zip(start, occupancy.shape, strict=True))
    clipped = fields.occupancy[box], fields.distance[box], fields.velocity[(slice(None), *box)]
    _clip_to_band(occupancy, distance, velocity, np.float32(reach), *clipped)
    return fields


@njit(cache=True)
def _clip_to_band(
    occupancy: np.ndarray,
    distance: np.ndarray,
    velocity: np.ndarray,
    reach: np.float32,
    shares: np.ndarray,
    distances: np.ndarray,
    velocities: np.ndarray,
) -> None:
    """Write the first three arrays into the last three, made to agree."""
    nearest = np.float32(NEAREST)
    for i in range(occupancy.shape[0]):
        for j in range(occupancy.shape[1]):
            for k in range(occupancy.shape[2]):
                shares[i, j, k] = occupancy[i, j, k]
                away = min(max(distance[i, j, k], -reach), reach)
                if occupancy[i, j, k] > 0.5:
                    away = min(away, -nearest)
                else:
                    away = max(away, nearest)
                if away < reach - 0.01:
                    distances[i, j, k] = away
                    for a in range(3):
                        velocities[a, i, j, k] = velocity[a, i, j, k]


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
