# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers that the networks are built of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torch.overrides import TorchFunctionMode

CHANNEL_MULTIPLE = 8
"""Channels that a processor's float32 kernels take at a time. Five took six times as long as eight
of which three are zero."""


INITIALISING = (Tensor.normal_, Tensor.uniform_, Tensor.zero_, Tensor.fill_)
"""What the layers' own initialisation calls."""


class Unwritten(TorchFunctionMode):
    """Within this block layers are made on the meta device, and their weights are never written.

    There is nothing to be written to; torch would import its compiler for it, which takes seconds.
    """

    def __enter__(self) -> Unwritten:
        """Have tensors made on the meta device."""
        self._device = torch.device("meta")
        self._device.__enter__()
        super().__enter__()  # type: ignore[no-untyped-call]
        return self

    def __exit__(self, *error: Any) -> None:
        """Make tensors as before."""
        super().__exit__(*error)  # type: ignore[no-untyped-call]
        self._device.__exit__(*error)

    def __torch_function__(
        self,
        function: Callable[..., Any],
        types: Sequence[type],
        inputs: Sequence[Any] = (),
        options: Mapping[str, Any] | None = None,
    ) -> Any:
        """Call a function of torch, unless it would write."""
        if function in INITIALISING:
            return inputs[0]
        return function(*inputs, **(options or {}))


class Convolution(nn.Conv3d):
    """A 3D convolution that for inference in float32 on a processor takes its fastest form.

    One of 1^3 cells is a matrix product, which takes half the time when it is computed as one.
    """

    def forward(self, x: Tensor, more: Tensor | None = None) -> Tensor:
        """Return the convolution of ``x``; more : ``(C,)``, added to the bias."""
        bias = bias_sum(self.bias, more)
        if torch.is_grad_enabled() or x.dtype != torch.float32 or x.device.type != "cpu":
            return self._conv_forward(x, self.weight, bias)
        if self.kernel_size == (1, 1, 1):
            product = F.linear(x.permute(0, 2, 3, 4, 1), self.weight.flatten(1), bias)
            return product.permute(0, 4, 1, 2, 3)
        if self.in_channels % CHANNEL_MULTIPLE == 0:
            return self._conv_forward(x, self.weight, bias)
        missing = (0,) * 7 + (-self.in_channels % CHANNEL_MULTIPLE,)
        return self._conv_forward(F.pad(x, missing), F.pad(self.weight, missing), bias)


def bias_sum(bias: Tensor | None, more: Tensor | None) -> Tensor | None:
    """Return the sum of two biases, either of which may be missing."""
    return more if bias is None else bias if more is None else bias + more


def convolution(inputs: int, outputs: int, size: int, stride: int = 1) -> nn.Conv3d:
    """Return a convolution that keeps the size of its input, or divides it by ``stride``."""
    layer = Convolution(inputs, outputs, size, stride, size // 2 if stride == 1 else 0)
    nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
    assert layer.bias is not None
    nn.init.zeros_(layer.bias)
    return layer


def zero_initialised(layer: nn.Conv3d) -> nn.Conv3d:
    """Return the layer with its weights set to zero: it adds nothing until it has learned to."""
    nn.init.zeros_(layer.weight)
    return layer


def in_place_sum(total: Tensor, more: Tensor) -> Tensor:
    """Return the sum; for inference in ``total`` itself, as allocating takes longer than adding."""
    if torch.is_grad_enabled() or total.dtype != more.dtype:
        return total + more
    return total.add_(more)


class ResidualBlock(nn.Module):
    """Two 3^3 convolutions around a shortcut; the identity at first, so no norm is needed.

    Batch norm would tie a result to how much air the other boxes of its batch held.
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = convolution(width, width, 3)
        self.second = zero_initialised(convolution(width, width, 3))

    def forward(self, x: Tensor) -> Tensor:
        return F.relu_(in_place_sum(self.second(F.relu_(self.first(x))), x))


def residual_blocks(width: int, count: int) -> nn.Sequential:
    """Return ``count`` residual blocks."""
    return nn.Sequential(*(ResidualBlock(width) for _ in range(count)))


class Modulation(nn.Module):
    """Scale and shift features by a latent; the identity where the latent is zero."""

    def __init__(self, latent: int, width: int) -> None:
        super().__init__()
        self.scale = zero_initialised(nn.Conv3d(latent, width, 1, bias=False))
        self.shift = nn.Conv3d(latent, width, 1, bias=False)

    def forward(self, x: Tensor, latent: Tensor) -> Tensor:
        fine = F.interpolate(latent, size=x.shape[2:], mode="trilinear").to(x.dtype)
        return x * (1 + self.scale(fine)) + self.shift(fine)
