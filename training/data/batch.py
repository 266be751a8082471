# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches of training samples as tensors; their conditions stay sparse."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from liquid_splash_addon.core.condition.channels import PATCH_VELOCITY, STROKE_VELOCITY
from liquid_splash_addon.core.generator.sparse import SparseCondition

from .samples import Sample

VELOCITY_SCALE = 5.0
"""m/s; the paper divides velocities by the fastest streamlet's speed."""


@dataclass(frozen=True)
class Cells:
    """Condition and truth on one grid. B samples of X x Y x Z cells.

    Attributes
    ----------
    condition : of shape ``(B, X, Y, Z)``, velocities over the velocity scale
    distance : ``(B, X, Y, Z)`` cells, +-AIR
    velocity : ``(B, 3, X, Y, Z)`` over the velocity scale
    """

    condition: SparseCondition
    distance: Tensor
    velocity: Tensor

    @classmethod
    def of(cls, samples: Sequence[Sample]) -> Cells:
        """Return samples of one shape as tensors."""
        condition = SparseCondition.batched([sample.condition for sample in samples])
        for which in (STROKE_VELOCITY, PATCH_VELOCITY):
            condition.values[:, which] /= VELOCITY_SCALE
        velocity = np.stack([sample.velocity for sample in samples]) / np.float32(VELOCITY_SCALE)
        distance = np.stack([sample.distance for sample in samples])
        return cls(condition, torch.from_numpy(distance), torch.from_numpy(velocity))

    def to(self, device: str) -> Cells:
        """Return the same on a device; without waiting for it where the memory is pinned."""
        return Cells(
            self.condition.to(device, non_blocking=True),
            self.distance.to(device, non_blocking=True),
            self.velocity.to(device, non_blocking=True),
        )

    def pin_memory(self) -> Cells:
        """Return a copy in memory that a GPU reads by itself."""
        return Cells(
            self.condition.pin_memory(), self.distance.pin_memory(), self.velocity.pin_memory()
        )


@dataclass(frozen=True)
class Batch:
    """A batch on one device.

    Attributes
    ----------
    box : whole boxes
    obstacle : ``(B, 1, X, Y, Z)``, closeness of the obstacle (``core.generator.sparse.closeness``)
    detail : a part of each box at twice the resolution; None where there is none
    start : int64 ``(B, 3)``, the part's first cell on the fine grid, on the processor
    """

    box: Cells
    obstacle: Tensor
    detail: Cells | None = None
    start: Tensor | None = None

    def to(self, device: str) -> Batch:
        """Return the batch on another device."""
        if device == "cpu":
            return self
        detail = None if self.detail is None else self.detail.to(device)
        obstacle = self.obstacle.to(device, non_blocking=True)
        return Batch(self.box.to(device), obstacle, detail, self.start)

    def pin_memory(self) -> Batch:
        """Return a copy in memory that a GPU reads by itself, as torch's loader asks for."""
        detail = None if self.detail is None else self.detail.pin_memory()
        return Batch(self.box.pin_memory(), self.obstacle.pin_memory(), detail, self.start)
