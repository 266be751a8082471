# SPDX-License-Identifier: GPL-3.0-or-later
"""Conditions in batches, for tests that write them cell by cell."""

import torch
from torch import Tensor

from liquid_splash_addon.core.condition.channels import CHANNELS, PATCH_CLOSENESS, STROKE_OCCUPANCY
from liquid_splash_addon.core.generator.sparse import SparseCondition


def sparse_condition(condition: Tensor) -> SparseCondition:
    """Return the crossed cells of ``(B, 18, X, Y, Z)``: the inverse of ``dense``."""
    where = (condition[:, STROKE_OCCUPANCY] + condition[:, PATCH_CLOSENESS]).nonzero()
    batch, x, y, z = where.unbind(1)
    return SparseCondition(
        where, condition[batch, :, x, y, z], (len(condition), *condition.shape[2:])
    )


def random_condition(cells, share=0.01):
    """Return made-up strokes and patches, ``(1, 18, n, n, n)``."""
    rng = torch.Generator().manual_seed(1)
    shape = (1, 1, cells, cells, cells)
    crossed = (torch.rand(shape, generator=rng) < share).float()
    velocity = torch.randn(1, 3, *shape[2:], generator=rng)
    place = torch.rand(1, 3, *shape[2:], generator=rng) - 0.5
    strokes = crossed * torch.cat([torch.ones(shape), velocity, place], dim=1)
    patched = (torch.rand(shape, generator=rng) < 4 * share).float()
    patches = torch.rand(1, CHANNELS - PATCH_CLOSENESS, *shape[2:], generator=rng) - 0.5
    patches[:, :3] += 0.5
    return torch.cat([strokes, patched * patches], dim=1)
