# SPDX-License-Identifier: GPL-3.0-or-later
"""What the networks are shown: conditions (``condition.voxelize``) as sparse batches of tensors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from ..condition.channels import (
    CHANNELS,
    PATCH,
    PATCH_CLOSENESS,
    PATCH_OFFSET,
    PATCH_VELOCITY,
    STROKE,
    STROKE_OCCUPANCY,
    STROKE_OFFSET,
    STROKE_VELOCITY,
)
from ..condition.voxelize import Condition

NEARNESS = (4, 16)
"""Edges of the blocks over which the strokes' density is averaged, cells."""

FEW_CROSSED = 1e-4
"""Share of crossed cells below which a block takes its neighbourhood's velocity instead."""


class SparseCondition(NamedTuple):
    """The cells of conditions that strokes or patches cross: few, so work on them is cheap.

    where : int64 ``(n, 4)``, sample, x, y, z; values : float32 ``(n, 18)``, the channels there (see
    ``condition.channels``); shape : of the batch, ``(B, X, Y, Z)``.
    """

    where: Tensor
    values: Tensor
    shape: tuple[int, ...]

    @classmethod
    def of(cls, condition: Condition) -> SparseCondition:
        """Return a condition as a batch of one."""
        where = F.pad(torch.from_numpy(condition.where).long(), (1, 0))
        return cls(where, torch.from_numpy(condition.values), (1, *condition.shape))

    @classmethod
    def batched(cls, conditions: Sequence[Condition]) -> SparseCondition:
        """Return conditions of one shape as a batch, a copy.

        Cells lie in the order of a dense array's, so that sums over them do not depend on the order
        in which strokes were drawn.
        """
        where, values = [], []
        for number, condition in enumerate(conditions):
            order = np.lexsort(condition.where.T[::-1])
            where.append(np.insert(condition.where[order].astype(np.int64), 0, number, axis=1))
            values.append(condition.values[order])
        shape = (len(conditions), *conditions[0].shape)
        cells = torch.from_numpy(np.concatenate(where))
        return cls(cells, torch.from_numpy(np.concatenate(values)), shape)

    def dense(self) -> Tensor:
        """All cells, ``(B, 18, X, Y, Z)``, channels last; zero where nothing crosses."""
        cells = self.values.new_zeros(*self.shape, self.values.shape[1])
        return cells.index_put(self.where.unbind(1), self.values).permute(0, 4, 1, 2, 3)

    def stroke_occupancy(self) -> Tensor:
        """Occupancy by strokes of all cells, ``(B, X, Y, Z)``: 1 where one crosses, else 0."""
        cells = self.values.new_zeros(self.shape)
        return cells.index_put(self.where.unbind(1), self.values[:, STROKE_OCCUPANCY])

    def scaled(self, unit: float, limit: float) -> SparseCondition:
        """Return the same with velocities over ``unit``, after those above ``limit`` are shortened.

        unit, limit : m/s
        """
        values = self.values.clone()
        for which in (STROKE_VELOCITY, PATCH_VELOCITY):
            velocity = self.values[:, which]
            speed = torch.linalg.vector_norm(velocity, dim=1, keepdim=True)
            values[:, which] = velocity * (limit / speed.clamp_min(limit)) / unit
        return self._replace(values=values)

    def to(self, device: str | torch.device, non_blocking: bool = False) -> SparseCondition:
        """Return the same on a device; non_blocking : see ``torch.Tensor.to``."""
        where, values = (x.to(device, non_blocking=non_blocking) for x in self[:2])
        return self._replace(where=where, values=values)

    def pin_memory(self) -> SparseCondition:
        """Return a copy in memory that a GPU reads by itself."""
        return self._replace(where=self.where.pin_memory(), values=self.values.pin_memory())

    def part(self, box: tuple[slice, ...]) -> SparseCondition:
        """Return what lies in a box of cells, numbered from its corner."""
        low = self.where.new_tensor([0, *(side.start for side in box)])
        high = self.where.new_tensor([self.shape[0], *(side.stop for side in box)])
        inside = ((self.where >= low) & (self.where < high)).all(1)
        sides = (side.stop - side.start for side in box)
        return SparseCondition(
            self.where[inside] - low, self.values[inside], (self.shape[0], *sides)
        )

    def halves(self) -> tuple[Tensor, tuple[int, ...]]:
        """Number ``(n,)`` of each one's cell among cells twice as large, and the shape of those."""
        shape = (self.shape[0], *(n // 2 for n in self.shape[1:]))
        batch, x, y, z = self.where.unbind(1)
        return ((batch * shape[1] + x // 2) * shape[2] + y // 2) * shape[3] + z // 2, shape

    def gathered(self, values: Tensor, air: Tensor) -> Tensor:
        """Return ``values`` ``(n, C)`` summed over cells twice as large, channels last.

        air : ``(C,)``, where every sum begins. The result is ``(B, C, X / 2, Y / 2, Z / 2)``.
        """
        cell, shape = self.halves()
        sums = air.to(values.dtype).repeat(math.prod(shape), 1)
        # Not index_put: its threads add in any order, so a seed would not give one splash only.
        sums = sums.index_add(0, cell, values)
        return sums.view(*shape, -1).permute(0, 4, 1, 2, 3)

    def gathered_onto(self, total: Tensor, values: Tensor) -> Tensor:
        """Return the sum of ``total`` and of ``values`` as summed by :meth:`gathered`.

        For inference, in ``total`` itself: few of its cells are crossed.
        """
        rows = total.permute(0, 2, 3, 4, 1)
        if torch.is_grad_enabled() or total.dtype != values.dtype or not rows.is_contiguous():
            return total + self.gathered(values, values.new_zeros(values.shape[1]))
        cell, _ = self.halves()
        rows.view(-1, values.shape[1]).index_add_(0, cell, values)
        return total


def halved(crossed: SparseCondition) -> SparseCondition:
    """Return the condition on cells twice as large: crossed if one of eight is, with means."""
    values = torch.cat(
        [crossed.values, (crossed.values[:, PATCH_CLOSENESS, None] > 0).float()], dim=1
    )
    octant = crossed.where[:, 1:] % 2 - 0.5
    for which, there in (
        (STROKE_OFFSET, values[:, STROKE_OCCUPANCY]),
        (PATCH_OFFSET, values[:, CHANNELS]),
    ):
        values[:, which] = (values[:, which] + octant) / 2 * there[:, None]
    cell, shape = crossed.halves()
    cells, row = torch.unique(cell, return_inverse=True)
    sums = values.new_zeros(len(cells), CHANNELS + 1).index_add(0, row, values)
    drawn, patched = sums[:, :1], sums[:, CHANNELS:]
    means = [
        (drawn > 0).to(sums.dtype),
        sums[:, 1 : STROKE.stop] / drawn.clamp_min(1),
        sums[:, PATCH] / patched.clamp_min(1),
    ]
    return SparseCondition(unravelled(cells, shape), torch.cat(means, 1), shape)


def unravelled(cells: Tensor, shape: Sequence[int]) -> Tensor:
    """Return the indices ``(n, len(shape))`` of flat indices ``cells``.

    As torch.unravel_index, whose first call imports a package for algebra, for a second.
    """
    columns = []
    for size in reversed(shape):
        columns.append(cells % size)
        cells = cells.div(size, rounding_mode="floor")
    return torch.stack(columns[::-1], 1)


def strided_stem(stem: nn.Conv3d, crossed: SparseCondition, total: Tensor) -> Tensor:
    """Return ``total`` and ``stem`` of the condition, a convolution of 2^3 cells by steps of 2.

    Without its bias and its further input channels, if it has any. total :
    ``(B, C, X / 2, Y / 2, Z / 2)``; inference may overwrite it.
    """
    kernels = stem.weight[:, :CHANNELS].permute(2, 3, 4, 1, 0).flatten(0, 2)  # (8, 18, C)
    eighth = crossed.where[:, 1:] % 2 @ crossed.where.new_tensor([4, 2, 1])
    order = eighth.argsort()
    groups = torch.bincount(eighth, minlength=8).tolist()
    given = torch.split(crossed.values[order].to(kernels.dtype), groups)
    values = torch.cat([part @ kernel for part, kernel in zip(given, kernels, strict=True)])
    return crossed._replace(where=crossed.where[order]).gathered_onto(total, values)


def closeness(distance: Tensor, spacing: float) -> Tensor:
    """Return how near an obstacle is, 0 (25 mm away) to 1 (25 mm inside).

    distance : signed distance to it in cells of ``spacing`` metres.
    """
    return (0.5 - distance * (spacing / 0.05)).clamp(0, 1)


def block_means(crossed: SparseCondition) -> Tensor:
    """Return the mean of the strokes' occupancy and velocity over cells twice as large.

    The result is ``(B, 4, X / 2, Y / 2, Z / 2)``.
    """
    drawn = crossed.values[:, : STROKE_VELOCITY.stop]
    return crossed.gathered(drawn, drawn.new_zeros(STROKE_VELOCITY.stop)).contiguous() / 8


def nearness(blocks: Tensor) -> Tensor:
    """Return the density of strokes around each cell, one channel for each size in NEARNESS.

    About 1 where one stroke passes. blocks : of :func:`block_means`; the result is
    ``(B, 2, X, Y, Z)``.
    """
    shape = [2 * n for n in blocks.shape[2:]]
    means = []
    for size in NEARNESS:
        density = F.avg_pool3d(blocks[:, :1], size // 2) * size**2
        means.append(F.interpolate(density, size=shape, mode="trilinear"))
    return torch.cat(means, dim=1)


def diffused_velocity(blocks: Tensor) -> Tensor:
    """Return the strokes' velocity spread over the whole grid, ``(B, 3, X, Y, Z)``.

    Push-pull: averages over ever larger blocks, then from coarse to fine the block's own
    average wherever a stroke crosses enough of it. blocks : of :func:`block_means`.
    """
    levels = [(blocks[:, :1], blocks[:, STROKE_VELOCITY])]
    while min(blocks.shape[2:]) > 1 and not any(n % 2 for n in blocks.shape[2:]):
        blocks = F.avg_pool3d(blocks, 2)
        levels.append((blocks[:, :1], blocks[:, STROKE_VELOCITY]))
    weight, flow = levels[-1]
    spread = sum_over_cells(flow) / sum_over_cells(weight).clamp_min(1e-9)
    for weight, flow in reversed(levels):
        spread = F.interpolate(spread, size=weight.shape[2:], mode="trilinear")
        spread = (flow + FEW_CROSSED * spread) / (weight + FEW_CROSSED)
    return F.interpolate(spread, scale_factor=2, mode="trilinear")


def sum_over_cells(x: Tensor) -> Tensor:
    """Return ``(B, C, 1, 1, 1)``."""
    return x.sum((2, 3, 4), keepdim=True)
