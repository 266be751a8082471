# SPDX-License-Identifier: GPL-3.0-or-later
"""What the network is trained on."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional as F

from liquid_splash_addon.core.liquid.fields import AIR

VELOCITY_SCALE = 5.0
"""m/s; the paper divides velocities by the fastest streamlet's speed."""

BACKGROUND = 0.05
"""Weight of cells far from liquid and strokes: there are many, and they are easy."""

NEAR = 8
"""Cells within about this distance of liquid or strokes have full weight."""


class Cells(NamedTuple):
    """Condition and truth on one grid. B samples of X x Y x Z cells.

    condition : ``(B, 18, X, Y, Z)``, velocity over the velocity scale
    distance : ``(B, X, Y, Z)`` cells, +-AIR
    velocity : ``(B, 3, X, Y, Z)`` over the velocity scale
    """

    condition: Tensor
    distance: Tensor
    velocity: Tensor


class Batch(NamedTuple):
    """A batch on one device: whole boxes, as in :class:`Cells`, and perhaps more of them.

    obstacle : ``(B, 1, X, Y, Z)`` of ``condition.closeness``
    detail : a part of each box at twice the resolution
    start : ``(B, 3)``, the part's first cell on the fine grid
    """

    condition: Tensor
    distance: Tensor
    velocity: Tensor
    obstacle: Tensor
    detail: Cells | None = None
    start: Tensor | None = None

    @property
    def box(self) -> Cells:
        """The whole boxes."""
        return Cells(self.condition, self.distance, self.velocity)

    def to(self, device: str) -> Batch:
        """Return the batch on another device."""
        if device == "cpu":
            return self
        box = Cells(*(t.to(device, non_blocking=True) for t in self.box))
        obstacle = self.obstacle.to(device, non_blocking=True)
        if self.detail is None:
            return Batch(*box, obstacle)
        detail = Cells(*(t.to(device, non_blocking=True) for t in self.detail))
        return Batch(*box, obstacle, detail, self.start)


def band(cells: Cells) -> Tensor:
    """Return each cell's weight ``(B, X, Y, Z)``: 1 near liquid or strokes, else BACKGROUND."""
    occupied = torch.maximum((cells.distance < 0).float(), cells.condition[:, 0])[:, None]
    blocks = F.max_pool3d(occupied, NEAR // 2)
    near = F.max_pool3d(blocks, 5, stride=1, padding=2)
    near = F.interpolate(near, scale_factor=NEAR // 2, mode="nearest")[:, 0]
    return near + BACKGROUND * (1 - near)


def sample_losses(output: Tensor, cells: Cells) -> Tensor:
    """Return the loss of each sample, ``(B,)``.

    Binary cross-entropy and soft Dice of the occupancy, L1 of the truncated distance, L1 of
    the velocity in the liquid (dilated by a cell), relative to the splash's mean speed.

    output : ``(B, 5, X, Y, Z)`` of the network.
    """
    weight = band(cells)
    truth = (cells.distance < 0).float()
    # Split, not sliced: each slice's gradient would be an array of zeros as large as the output.
    logit, shape, flow = torch.split(output, [1, 1, 3], dim=1)
    logit, shape = logit[:, 0], shape[:, 0]
    cross = F.binary_cross_entropy_with_logits(logit, truth, reduction="none")
    entropy = mean(cross, weight)
    shape_error = mean((shape - cells.distance / AIR).abs(), weight)
    liquid = (cells.distance < 1).float()
    error = (flow - cells.velocity).abs().sum(1)
    speed = mean(cells.velocity.abs().sum(1), liquid).clamp_min(0.02)
    return (
        entropy
        + dice(torch.sigmoid(logit), truth)
        + shape_error
        + 0.3 * mean(error, liquid) / speed
    )


def dice(probability: Tensor, truth: Tensor) -> Tensor:
    """Return 1 - soft Dice of each sample, ``(B,)``; samples without liquid add one cell."""
    common = (probability * truth).sum((1, 2, 3))
    total = probability.sum((1, 2, 3)) + truth.sum((1, 2, 3))
    return 1 - (2 * common + 1) / (total + 1)


def mean(values: Tensor, weight: Tensor) -> Tensor:
    """Return the weighted mean of each sample, ``(B,)``."""
    return (values * weight).sum((1, 2, 3)) / weight.sum((1, 2, 3)).clamp_min(1.0)
