# SPDX-License-Identifier: GPL-3.0-or-later
"""A 3D pixel shuffle: eight channels of a cell become its eight octants."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from ..compiling import njit
from ..numeric.threads import in_parts
from .bfloat16 import bits


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
    """Do what :func:`pixel_shuffle` does, in float32 and in one pass.

    The network's result is its largest array: torch's general sum of it took as long as the largest
    convolution.
    """
    batch, channels, *shape = len(x), x.shape[1] // 8, *x.shape[2:]
    if base is None:
        base = x.new_zeros((batch, channels, *shape), dtype=torch.float32)
    # NumPy asks for huge pages, torch does not: getting its memory took longer than writing to it.
    result = np.empty((batch, channels, *(2 * n for n in shape)), dtype=np.float32)
    cells, shift = bits(x.permute(0, 2, 3, 4, 1))
    under = base.contiguous().numpy()
    for number in range(batch):
        parts = (cells[number], shift, under[number], result[number])
        in_parts(shape[0], lambda begin, end: add_octants(*parts, begin, end))  # noqa: B023
    return torch.from_numpy(result)


@njit(cache=True)
def add_octants(
    x: np.ndarray, shift: np.uint32, base: np.ndarray, result: np.ndarray, begin: int, end: int
) -> None:
    """Write ``x`` ``(X, Y, Z, 8 C)`` plus ``base`` ``(C, X, Y, Z)`` into ``result``.

    x, shift : see :func:`bfloat16.bits`; begin, end : planes of X to do.
    """
    channels, _, rows, columns = base.shape
    widened = np.empty((columns, 8 * channels), dtype=np.uint32)
    values = widened.view(np.float32)
    for i in range(begin, end):
        for j in range(rows):
            for k in range(columns):
                for c in range(8 * channels):
                    widened[k, c] = np.uint32(x[i, j, k, c]) << shift
            for c in range(channels):
                for half in range(4):
                    first = 8 * c + 2 * half
                    line = result[c, 2 * i + half // 2, 2 * j + half % 2]
                    for k in range(columns):
                        line[2 * k] = values[k, first] + base[c, i, j, k]
                        line[2 * k + 1] = values[k, first + 1] + base[c, i, j, k]
