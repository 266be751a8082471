# SPDX-License-Identifier: GPL-3.0-or-later
"""What the network is trained on."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional as F

from liquid_splash_addon.core.liquid.fields import AIR

from ..data.batch import Cells

BACKGROUND = 0.05
"""Weight of cells far from liquid and strokes: there are many, and they are easy."""

NEAR_CELLS = 8
"""Cells within about this distance of liquid or strokes have full weight."""


def cell_weights(cells: Cells) -> Tensor:
    """Weight ``(B, X, Y, Z)`` of each cell: 1 near liquid or strokes, else BACKGROUND."""
    liquid = (cells.distance < 0).float()
    occupied = torch.maximum(liquid, cells.condition.stroke_occupancy())[:, None]
    blocks = F.max_pool3d(occupied, NEAR_CELLS // 2)
    near = F.max_pool3d(blocks, 5, stride=1, padding=2)
    near = F.interpolate(near, scale_factor=NEAR_CELLS // 2, mode="nearest")[:, 0]
    return near + BACKGROUND * (1 - near)


def sample_losses(output: Tensor, cells: Cells) -> Tensor:
    """Loss ``(B,)`` of each sample.

    Binary cross-entropy and soft Dice of the occupancy, L1 of the truncated distance, L1 of
    the velocity in the liquid (dilated by a cell), relative to the splash's mean speed.

    output : ``(B, 5, X, Y, Z)`` of the network.
    """
    weight = cell_weights(cells)
    truth = (cells.distance < 0).float()
    # Split, not sliced: each slice's gradient would be an array of zeros as large as the output.
    logit, distance, velocity = torch.split(output, [1, 1, 3], dim=1)
    logit, distance = logit[:, 0], distance[:, 0]
    cross = F.binary_cross_entropy_with_logits(logit, truth, reduction="none")
    entropy = weighted_mean(cross, weight)
    distance_error = weighted_mean((distance - cells.distance / AIR).abs(), weight)
    liquid = (cells.distance < 1).float()
    error = (velocity - cells.velocity).abs().sum(1)
    speed = weighted_mean(cells.velocity.abs().sum(1), liquid).clamp_min(0.02)
    return (
        entropy
        + dice_loss(torch.sigmoid(logit), truth)
        + distance_error
        + 0.3 * weighted_mean(error, liquid) / speed
    )


def dice_loss(probability: Tensor, truth: Tensor) -> Tensor:
    """1 - soft Dice ``(B,)`` of each sample; one cell is added to both, for those without liquid.

    probability, truth : ``(B, X, Y, Z)``, 0..1
    """
    common = (probability * truth).sum((1, 2, 3))
    total = probability.sum((1, 2, 3)) + truth.sum((1, 2, 3))
    return 1 - (2 * common + 1) / (total + 1)


def weighted_mean(values: Tensor, weight: Tensor) -> Tensor:
    """Mean ``(B,)`` of each sample; values, weight : ``(B, X, Y, Z)``."""
    return (values * weight).sum((1, 2, 3)) / weight.sum((1, 2, 3)).clamp_min(1.0)
