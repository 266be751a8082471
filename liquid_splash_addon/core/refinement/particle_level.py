# SPDX-License-Identifier: GPL-3.0-or-later
"""Drops as a signed distance, on cells half as large and only where there are particles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..compiling import njit
from ..fluid.cells import Cells, activate, find
from ..liquid.fields import AIR
from .pbf import PbfParticles

FINER = 2
"""Fine cells along the edge of a cell."""

DROP_KERNEL_REACH = 4.0
"""Reach of a particle's weight over its spacing."""

DROP_PARTICLE_RADIUS = 1.18
"""Distance of the surface from the weighted mean of the particles near it, over their spacing:
a ball of 100 to 400 particles then has the volume that they represent, within 5 %."""

LOOSE_SHARE, DENSE_SHARE = 0.12, 0.22
"""Shares of the space around a point that particles fill. Those of a drop fill over a quarter at
its surface. Where they fill less, they have flown apart, and none of them may be near their mean:
the surface must then also lie within balls around the particles."""

LOOSE_RADIUS, DENSE_RADIUS = 0.62, 1.4
"""Radii of these balls over the spacing: from that of a particle's volume at LOOSE_SHARE to
one that reaches beyond a drop's surface at DENSE_SHARE."""

AIR_LAYERS = 4
"""Layers of fine cells around the particles that get a distance."""


@dataclass(frozen=True)
class FineLevel:
    """The surface of particles, on sparse fine cells.

    Attributes
    ----------
    cells : the fine cells; their coordinates count from ``start``
    start : int ``(3,)``, fine cell of the splash's grid at which they begin
    level : float32 ``(n,)``, in fine cells, negative in the drops
    velocity : float32 ``(n, 3)``, cells per second, of the particles near each cell
    """

    cells: Cells
    start: np.ndarray
    level: np.ndarray
    velocity: np.ndarray

    @classmethod
    def of(cls, particles: PbfParticles) -> FineLevel:
        """Return the surface of ``particles`` (Zhu and Bridson 2005, for various sizes)."""
        fine = particles.positions * FINER
        # An even start, so that every cell of the splash's grid consists of eight fine ones.
        start = (np.floor(fine.min(axis=0)).astype(np.int64) - AIR_LAYERS - 2) // FINER * FINER
        placed = (fine - start).astype(np.float32)
        x, y, z = (int(n) + AIR_LAYERS + 3 for n in placed.max(axis=0))
        cells = activate(placed, (x, y, z), AIR_LAYERS)
        sums = np.zeros((len(cells.coordinates), 11), dtype=np.float32)
        _accumulate(
            placed, particles.spacing * FINER, particles.velocities, cells.table, cells.leaves, sums
        )
        known = np.maximum(sums[:, :1], 1e-12)
        level = (
            np.linalg.norm(sums[:, 1:4] / known, axis=1)
            - DROP_PARTICLE_RADIUS * sums[:, 4] / known[:, 0]
        )
        level = np.maximum(level, _balls(*sums[:, 8:].T))
        level[sums[:, 0] <= 0] = AIR
        return cls(cells, start, level.astype(np.float32), sums[:, 5:8] / known)

    def coarse(
        self, shape: tuple[int, int, int], drawn: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the level on the splash's grid of ``shape`` cells.

        Returns the flat indices ``(m,)`` of the cells, their level in cells ``(m,)`` and velocity
        ``(m, 3)``: means of their fine cells. Cells with fewer than eight of those are left out.

        drawn : bool ``(n,)``, the fine cells that count.
        """
        coordinates = (self.cells.coordinates + self.start) // FINER
        inside = drawn & ((coordinates >= 0) & (coordinates < shape)).all(axis=1)
        flat = np.ravel_multi_index(tuple(coordinates[inside].T), shape)
        numbers, places, counts = np.unique(flat, return_inverse=True, return_counts=True)
        whole = counts == FINER**3
        level = np.bincount(places, self.level[inside]) / counts / FINER
        velocity = [np.bincount(places, self.velocity[inside, a]) / counts for a in range(3)]
        return (
            numbers[whole],
            level[whole].astype(np.float32),
            np.stack(velocity, axis=1)[whole].astype(np.float32),
        )

    def components(self) -> np.ndarray:
        """Return which drop each fine cell belongs to, int32 ``(n,)``, from 0 on; -1 for air."""
        label = np.arange(len(self.level), dtype=np.int32)
        _join(self.level, self.cells.neighbours, label)
        roots = np.flatnonzero((label == np.arange(len(label))) & (self.level < 0))
        names = np.full(len(label), -1, dtype=np.int32)
        names[roots] = np.arange(len(roots))
        return np.where(self.level < 0, names[label], -1).astype(np.int32)


def _balls(weight: np.ndarray, nearest: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """Return the distance ``(n,)`` to the ball around the nearest particle, in fine cells.

    weight : sum of the particles' weights; nearest : cube root of the largest of them;
    spacing : of that particle, fine cells.
    """
    # The weight's integral over the ball of its reach is 64 pi / 315 of the cube of the reach.
    filled = 315 / (64 * np.pi * DROP_KERNEL_REACH**3) * weight
    share = np.clip((filled - LOOSE_SHARE) / (DENSE_SHARE - LOOSE_SHARE), 0, 1)
    distance = DROP_KERNEL_REACH * np.sqrt(np.clip(1 - nearest, 0, 1))
    return np.asarray((distance - LOOSE_RADIUS - share * (DENSE_RADIUS - LOOSE_RADIUS)) * spacing)


@njit(cache=True, fastmath=True)
def _accumulate(positions, spacing, velocities, table, leaves, sums):
    """Add the weights of each particle to the cells in its reach.

    sums : float32 ``(n, 11)``: weight times volume, and that times offset (3), spacing and
    velocity (3); then the weight alone, and the cube root of the nearest particle's and its
    spacing. All in single precision: one double would make the whole loop double, and slower.
    """
    one, half = np.float32(1), np.float32(0.5)
    for p in range(len(positions)):
        x, y, z = positions[p, 0] - half, positions[p, 1] - half, positions[p, 2] - half
        i, j, k = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
        reach = np.float32(DROP_KERNEL_REACH) * spacing[p]
        span = int(np.ceil(reach))
        scale = one / (reach * reach)
        volume = spacing[p] ** 3
        for a in range(i - span + 1, i + span + 1):
            dx = x - np.float32(a)
            for b in range(j - span + 1, j + span + 1):
                dy = y - np.float32(b)
                for c in range(k - span + 1, k + span + 1):
                    dz = z - np.float32(c)
                    near = one - scale * (dx * dx + dy * dy + dz * dz)
                    if near <= 0:
                        continue
                    n = find(table, leaves, a, b, c)
                    if n < 0:
                        continue
                    w = near * near * near
                    sums[n, 8] += w
                    if near > sums[n, 9]:
                        sums[n, 9], sums[n, 10] = near, spacing[p]
                    w *= volume
                    sums[n, 0] += w
                    sums[n, 1] += w * dx
                    sums[n, 2] += w * dy
                    sums[n, 3] += w * dz
                    sums[n, 4] += w * spacing[p]
                    for axis in range(3):
                        sums[n, 5 + axis] += w * velocities[p, axis]


@njit(cache=True)
def _root(label, n):
    while label[n] != n:
        label[n] = label[label[n]]
        n = label[n]
    return n


@njit(cache=True)
def _join(level, neighbours, label):
    """Give all cells of one piece of liquid the number of one of them (union-find)."""
    for n in range(len(level)):
        if level[n] >= 0:
            continue
        for side in range(1, 6, 2):
            m = neighbours[n, side]
            if m >= 0 and level[m] < 0:
                a, b = _root(label, n), _root(label, m)
                label[max(a, b)] = min(a, b)
    for n in range(len(level)):
        label[n] = _root(label, n)


@njit(cache=True)
def fill_atlas(label, level, table, leaves, lows, sizes, offsets, atlas):
    """Copy each drop's box of fine cells into its place in ``atlas``, without other drops in it.

    lows, sizes : int ``(drops, 3)``, the boxes; offsets : ``(drops,)``, along the first axis.
    """
    for d in range(len(lows)):
        for i in range(sizes[d, 0]):
            for j in range(sizes[d, 1]):
                for k in range(sizes[d, 2]):
                    n = find(table, leaves, lows[d, 0] + i, lows[d, 1] + j, lows[d, 2] + k)
                    if n < 0:
                        continue
                    own = level[n] >= 0 or label[n] == d
                    atlas[offsets[d] + i, j, k] = level[n] if own else 1.0
