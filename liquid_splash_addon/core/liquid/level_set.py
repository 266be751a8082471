# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquid as a level set, whose zero is the surface that is meshed, and its velocity."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..compiling import njit
from ..fluid.surface import redistance
from ..grid import Grid
from ..numeric.trilinear import velocity_at
from .fields import AIR, NEAREST, Fields
from .volume import filled_cells

LEAST_PROBABILITY = 1e-4
"""Least probability, of liquid or of air, in any cell: logarithms stay finite."""

FLOW_MARGIN = 4
"""Cells around the liquid's box in which velocity is looked up too: some is known there."""


@dataclass(frozen=True)
class LevelSet:
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
    def of(cls, fields: Fields, threshold: float = 0.5) -> LevelSet:
        """Return the liquid whose surface is where the probability is ``threshold``."""
        return cls(surface_level(fields, threshold), fields.velocity, fields.grid)

    @cached_property
    def box(self) -> tuple[slice, slice, slice] | None:
        """The part of the grid that holds liquid, 4 cells wider; None without liquid."""
        return liquid_box(self.level)

    @cached_property
    def distance(self) -> np.ndarray:
        """Signed distance to the surface in cells, float32 ``(X, Y, Z)``, clipped at +-AIR.

        The level is no distance: steep where the generator was sure, flat where it was not.
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

        Where none is known, far from the liquid, it is that at ``instead`` ``(n, 3)``, or 0.
        """
        out = np.zeros((len(positions), 3))
        other = positions if instead is None else instead
        flow, corner = self._flow_last
        _flow(flow, positions - corner, other - corner, out)
        return out / self.grid.spacing

    @cached_property
    def _flow_last(self) -> tuple[np.ndarray, np.ndarray]:
        """Velocity around the liquid, components last, and the cell at which the array begins.

        ``(x, y, z, 3)``: a cell's velocity lies in one place. The outermost cells have none.
        """
        box = wider(self.box or (slice(0, 1),) * 3, FLOW_MARGIN)
        near = np.moveaxis(self.velocity[(slice(None), *box)], 0, -1)
        corner = np.array([side.start - 1.0 for side in box])
        return np.pad(near, ((1, 1), (1, 1), (1, 1), (0, 0))), corner

    @property
    def volume(self) -> float:
        """Volume in cells; a cell cut by the surface counts in part."""
        box = self.box
        return 0.0 if box is None else filled_cells(self.level[box])

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


def wider(box: tuple[slice, ...], margin: int) -> tuple[slice, ...]:
    """Return a box that begins and ends ``margin`` cells farther out, if the grid does."""
    return tuple(slice(max(side.start - margin, 0), side.stop + margin) for side in box)


def surface_level(fields: Fields, threshold: float) -> np.ndarray:
    """Return the field whose zero level is the surface, in cells, float32 ``(X, Y, Z)``.

    It is half the difference of the logits of ``threshold`` and occupancy, so that a cell is a
    factor e^2 of the odds: continuous in the threshold, negative exactly where occupancy is
    above it. The network's distance alone would lose sheets that it is not sure of.
    """
    surface_logit = np.log(threshold / (1 - threshold))
    air = np.log(LEAST_PROBABILITY / (1 - LEAST_PROBABILITY))
    level = np.full(fields.occupancy.shape, (surface_logit - air) / 2, dtype=np.float32)
    near = np.flatnonzero(fields.occupancy > LEAST_PROBABILITY)  # a few cells in a hundred
    odds = np.minimum(fields.occupancy.ravel()[near], 1 - LEAST_PROBABILITY)
    level.ravel()[near] = (surface_logit - np.log(odds / (1 - odds))) / 2
    return level


def probability(level: np.ndarray) -> np.ndarray:
    """Return the occupancy, float32, of which ``level`` is the :func:`surface_level`."""
    from scipy.special import expit

    return np.asarray(expit(-2 * level), dtype=np.float32)


def with_level(fields: Fields, before: np.ndarray, level: np.ndarray) -> Fields:
    """Return ``fields`` with the surface of ``level`` where that differs from ``before``.

    All else is kept bit for bit. Where it differs, the distance is the level, the velocity ends
    where the distance does, and cells that liquid has newly come near to have the velocity of
    the nearest cell that knew one.

    before, level : cells, float32 ``(X, Y, Z)``; before : the fields' own, of a threshold of 0.5.
    """
    where = np.nonzero(level != before)
    if not len(where[0]):
        return fields
    occupancy, distance, velocity = (
        array.copy() for array in (fields.occupancy, fields.distance, fields.velocity)
    )
    occupancy[where] = probability(level[where])
    sign = np.where(occupancy[where] > 0.5, -1, 1)
    away = sign * np.clip(sign * level[where], NEAREST, AIR)
    is_far = away >= AIR - 0.01  # as in clip_to_band: stored, it would round up to AIR
    was_near = distance[where] < AIR
    distance[where] = np.where(is_far, AIR, away)
    velocity[:, *np.stack(where)[:, is_far]] = 0
    fill_velocity(velocity, fields.distance < AIR, where, was_near, ~was_near & ~is_far)
    return Fields(occupancy, distance, velocity, fields.grid)


def fill_velocity(
    velocity: np.ndarray,
    near: np.ndarray,
    where: tuple[np.ndarray, ...],
    known: np.ndarray,
    unknown: np.ndarray,
) -> None:
    """Give the ``unknown`` ones of cells the velocity of the nearest ``known`` one, in place.

    Where none of them is known, it is looked for in all cells that are ``near`` to liquid.

    velocity : ``(3, X, Y, Z)``; near : bool ``(X, Y, Z)``; known, unknown : bool ``(n,)``.
    """
    from scipy.spatial import cKDTree

    if not unknown.any():
        return
    cells = np.stack(where, axis=1)
    sources = cells[known] if known.any() else np.argwhere(near)
    if not len(sources):
        return
    _, nearest = cKDTree(sources).query(cells[unknown])
    velocity[:, *cells[unknown].T] = velocity[:, *sources[nearest].T]


def liquid_box(level: np.ndarray, margin: int = 4) -> tuple[slice, slice, slice] | None:
    """Return the part of a grid that holds liquid, ``margin`` cells wider; None without liquid."""
    inside = level < 0
    columns, plane = inside.any(axis=2), inside.any(axis=0)
    parts = []
    for rows in (columns.any(axis=1), columns.any(axis=0), plane.any(axis=0)):
        wet = np.flatnonzero(rows)
        if not len(wet):
            return None
        parts.append(slice(max(int(wet[0]) - margin, 0), int(wet[-1]) + 1 + margin))
    return (parts[0], parts[1], parts[2])
