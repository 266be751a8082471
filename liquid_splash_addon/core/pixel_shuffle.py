# SPDX-License-Identifier: GPL-3.0-or-later
"""A 3D pixel shuffle: eight channels of a cell become its eight halves."""

from __future__ import annotations

import numpy as np
import torch
from numba import njit
from torch import Tensor

from .threads import in_parts


def pixel_shuffle(x: Tensor, base: Tensor | None = None) -> Tensor:
    """Turn ``(B, 8 C, X, Y, Z)`` into ``(B, C, 2X, 2Y, 2Z)``.

    base : float32 ``(B, C, X, Y, Z)`` that is added to all eight cells of each.
    """
    batch, channels, *shape = x.shape
    if x.device.type == "cpu" and not torch.is_grad_enabled():
        return shuffled_onto(x, base)
    x = x.reshape(batch, channels // 8, 2, 2, 2, *shape).permute(0, 1, 5, 2, 6, 3, 7, 4)
    if base is not None:
        x = x + base[:, :, :, None, :, None, :, None]
    return x.reshape(batch, channels // 8, *(2 * n for n in shape))


def shuffled_onto(x: Tensor, base: Tensor | None) -> Tensor:
    """Return what :func:`pixel_shuffle` does, in float32 and in one pass.

    The network's result is its largest array: torch's general sum took as long for it as the
    largest convolution.
    """
    batch, channels, *shape = len(x), x.shape[1] // 8, *x.shape[2:]
    if base is None:
        base = x.new_zeros((batch, channels, *shape), dtype=torch.float32)
    result = torch.empty((batch, channels, *(2 * n for n in shape)), dtype=torch.float32)
    cells = x.permute(0, 2, 3, 4, 1).float().contiguous().numpy()
    under = base.contiguous().numpy()
    for number in range(batch):
        parts = (cells[number], under[number], result[number].numpy())
        in_parts(shape[0], lambda begin, end: add_halves(*parts, begin, end))  # noqa: B023
    return result


@njit(nogil=True, cache=True)
def add_halves(x: np.ndarray, base: np.ndarray, result: np.ndarray, begin: int, end: int) -> None:
    """Write ``x`` ``(X, Y, Z, 8 C)`` plus ``base`` ``(C, X, Y, Z)`` into ``result``.

    begin, end : planes of X to do.
    """
    channels, _, rows, columns = base.shape
    for i in range(begin, end):
        for c in range(channels):
            for half in range(4):
                first = 8 * c + 2 * half
                for j in range(rows):
                    line = result[c, 2 * i + half // 2, 2 * j + half % 2]
                    for k in range(columns):
                        line[2 * k] = x[i, j, k, first] + base[c, i, j, k]
                        line[2 * k + 1] = x[i, j, k, first + 1] + base[c, i, j, k]
