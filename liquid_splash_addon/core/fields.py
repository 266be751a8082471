# SPDX-License-Identifier: GPL-3.0-or-later
"""What the generator gives: occupancy, signed distance and velocity on one grid."""

from __future__ import annotations

import io
import zlib
from dataclasses import dataclass
from zipfile import BadZipFile

import numpy as np

from .grid import Grid

PHI_CELLS = 4.0
"""Cells over which phi falls from 1 to 0, so that Table 2's phi_band = 0.4 is 1.6 cells."""

AIR = 3.0
"""Distance, in cells, that stands for "far from the liquid"."""


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

    def rounded(self) -> Fields:
        """Return the fields as they come back from :meth:`to_bytes`.

        What is made of these now can be made again, exactly, from a saved file.
        """
        near = np.flatnonzero(self.distance < AIR)  # a few cells in a hundred
        occupancy = self.occupancy * np.float32(255)
        np.rint(occupancy, out=occupancy)
        occupancy /= np.float32(255)
        distance = np.full(self.distance.shape, AIR, dtype=np.float32)
        velocity = np.zeros(self.velocity.shape, dtype=np.float32)
        for kept, field in ((distance, self.distance), *zip(velocity, self.velocity, strict=True)):
            kept.ravel()[near] = field.ravel()[near].astype(np.float16)
        return Fields(occupancy, distance, velocity, self.grid)

    def within(self, grid: Grid, start: tuple[int, int, int]) -> Fields:
        """Return the same as the part of ``grid`` that begins at cell ``start``; air elsewhere."""
        if grid.shape == self.grid.shape:
            return self
        box = tuple(slice(i, i + n) for i, n in zip(start, self.grid.shape, strict=True))
        occupancy = np.zeros(grid.shape, dtype=np.float32)
        distance = np.full(grid.shape, AIR, dtype=np.float32)
        velocity = np.zeros((3, *grid.shape), dtype=np.float32)
        occupancy[box], distance[box] = self.occupancy, self.distance
        velocity[(slice(None), *box)] = self.velocity
        return Fields(occupancy, distance, velocity, grid)

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


def settle(
    occupancy: np.ndarray,
    distance: np.ndarray,
    velocity: np.ndarray,
    grid: Grid,
    reach: float = AIR,
) -> Fields:
    """Return Fields whose parts agree: occupancy decides where liquid is.

    The distance keeps the sign of 0.5 - occupancy (at least a tenth of a cell where both
    disagree) and the velocity ends where the distance does.

    reach : greatest distance that is known, cells.
    """
    sign = np.where(occupancy > 0.5, -1.0, 1.0).astype(np.float32)
    agreed = sign * np.maximum(sign * distance, np.float32(0.1))
    near = agreed < reach - 0.01
    return Fields(occupancy, np.where(near, agreed, np.float32(AIR)), velocity * near, grid)
