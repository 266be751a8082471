# SPDX-License-Identifier: GPL-3.0-or-later
"""Convolutions in eight-bit integers, on processors.

With instructions for it (VNNI) they take half the time of bfloat16 and a quarter of that of
float32; with AVX2 alone a third of the latter.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from ..compiling import njit
from ..numeric.threads import in_parts
from .bfloat16 import bits
from .layers import bias_sum

SMALL_JOB = 1 << 16
"""Values below which threads cost more than they gain."""

CHUNK = 1024
"""Values that are widened at a time: they stay in the processor's first-level cache."""

LARGE_KERNEL = 27
"""Kernel cells from which on eight bits pay: for 2^3, rounding the input takes longer."""


def input_steps() -> int:
    """Return how many steps an input's range is divided into: 8 bits, or 7.

    Without VNNI processors add pairs of products in 16 bits, which 8 by 8 bits overflow.
    """
    has_vnni = getattr(torch.cpu, "_is_vnni_supported", lambda: False)
    return 255 if has_vnni() else 127


class QuantizedConvolution(nn.Module):
    """A 3D convolution whose weights and inputs are rounded to eight bits each.

    Weights are scaled by output channel; inputs by their range, found anew at every call, so
    that there is nothing to calibrate. The result is of the input's type. For inference only.

    Raises RuntimeError, NotImplementedError or AttributeError where torch has no such kernels.
    """

    def __init__(self, layer: nn.Conv3d) -> None:
        super().__init__()
        weight = layer.weight.detach().float().cpu()
        self.scales = (weight.abs().amax((1, 2, 3, 4)) / 127).clamp_min(1e-12)
        rounded = (weight / self.scales[:, None, None, None, None]).round().to(torch.int8)
        self.geometry: list[Any] = [list(layer.stride), list(layer.padding), list(layer.dilation)]
        self.geometry.append(layer.groups)
        # The input's scale and zero point are not known yet; they are passed at every call.
        pack = torch.ops.onednn.qconv_prepack
        self.weight = pack(rounded, self.scales, 1.0, 0, *self.geometry, None)
        self.convolve = torch.ops.onednn.qconv3d_pointwise
        self.zero_points = torch.zeros(len(weight), dtype=torch.int32)
        self.bias = None if layer.bias is None else layer.bias.detach().float().cpu()
        self.steps = input_steps()

    def forward(self, x: Tensor, more: Tensor | None = None) -> Tensor:
        """Return the convolution of ``x``; more : ``(C,)``, added to the bias."""
        bias = bias_sum(self.bias, None if more is None else more.float())
        values, scale, zero_point = quantize(x, self.steps)
        result: Tensor = self.convolve(
            values, scale, zero_point, self.weight, self.scales, self.zero_points, bias,
            *self.geometry, 1.0, 0, x.dtype, "none", [], "",
        )  # fmt: skip
        return result


def quantize(x: Tensor, steps: int) -> tuple[Tensor, float, int]:
    """Return ``x`` ``(B, C, X, Y, Z)`` as bytes from 0 to ``steps``, their scale and zero point.

    ``x`` is about ``scale * (bytes - zero point)``, and exact where it is 0. The bytes are
    channels last.
    """
    x = x.contiguous(memory_format=torch.channels_last_3d)
    # Not torch.aminmax, which took ten times as long as both.
    low, high = min(float(x.amin()), 0.0), max(float(x.amax()), 0.0)
    scale = max(high - low, 1e-12) / steps
    zero_point = round(-low / scale)
    result = torch.empty_like(x, dtype=torch.uint8)
    source, shift = bits(x.permute(0, 2, 3, 4, 1).view(-1))
    target = result.permute(0, 2, 3, 4, 1).view(-1).numpy()
    factor, zero, most = np.float32(1 / scale), np.float32(zero_point), np.float32(steps)

    def work(begin: int, end: int) -> None:
        round_to_bytes(source[begin:end], shift, factor, zero, most, target[begin:end])

    if len(source) < SMALL_JOB:
        work(0, len(source))
    else:
        in_parts(len(source), work)
    return result, scale, zero_point


@njit(fastmath=True, cache=True)
def round_to_bytes(
    values: np.ndarray,
    shift: np.uint32,
    factor: np.float32,
    zero: np.float32,
    most: np.float32,
    result: np.ndarray,
) -> None:
    """Write ``values * factor + zero``, rounded and kept within 0 to ``most``, into ``result``.

    values, shift : see :func:`bfloat16.bits`.
    """
    widened = np.empty(CHUNK, dtype=np.uint32)
    floats = widened.view(np.float32)
    for begin in range(0, values.size, CHUNK):
        count = min(CHUNK, values.size - begin)
        for i in range(count):
            widened[i] = np.uint32(values[begin + i]) << shift
        for i in range(count):
            value = floats[i] * factor + (zero + np.float32(0.5))
            result[begin + i] = np.uint8(min(max(value, np.float32(0)), most))


def quantize_convolutions(network: nn.Module) -> None:
    """Replace a network's convolutions of 3^3 cells and more: they are most of its work."""
    for module in list(network.modules()):
        for name, layer in list(module.named_children()):
            if isinstance(layer, nn.Conv3d) and math.prod(layer.kernel_size) >= LARGE_KERNEL:
                setattr(module, name, QuantizedConvolution(layer))
