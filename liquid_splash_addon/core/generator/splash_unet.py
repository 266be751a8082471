# SPDX-License-Identifier: GPL-3.0-or-later
"""The generator's networks: a draft of the whole box, then detail where there is liquid."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from ..condition.voxelize import CHANNELS
from .pixel_shuffle import pixel_shuffle
from .sparse import (
    NEARNESS,
    Crossed,
    crossed_cells,
    diffused_velocity,
    halved,
    in_blocks,
    nearness,
    patches,
)

OUTPUT_CHANNELS = 5  # occupancy logit, distance, velocity x, y, z


@dataclass(frozen=True)
class NetworkConfig:
    """Everything needed to rebuild the networks; written into the weights' header.

    Attributes
    ----------
    widths : channels of the draft's levels; the first level has half the draft's resolution
    encoder_blocks, decoder_blocks : residual blocks of each level (the decoder has one level less)
    detail_widths : channels of the detail network's two levels
    detail_blocks : its residual blocks: going down, at the coarse level, and going up. The fine
        level costs most of a splash, so there are few
    latent_channels : channels of the latent
    latent_cells : cells of the latent's lattice along each side of the local box
    """

    widths: tuple[int, ...] = (32, 64, 128, 256)
    encoder_blocks: tuple[int, ...] = (1, 2, 2, 2)
    decoder_blocks: tuple[int, ...] = (1, 1, 1)
    detail_widths: tuple[int, int] = (24, 48)
    detail_blocks: tuple[int, int, int] = (0, 2, 1)
    latent_channels: int = 8
    latent_cells: int = 8


EIGHT = 8
"""Channels that a processor's float32 kernels take at a time. Five took six times as long as
eight, of which three are zero."""


class Convolution(nn.Conv3d):
    """A 3D convolution that in use, in float32 on a processor, takes the form that is fast there.

    One of 1^3 cells is a matrix product, which takes half the time if it is told so.
    """

    def forward(self, x: Tensor, more: Tensor | None = None) -> Tensor:
        """Return the convolution of ``x``; more : ``(C,)``, added to the bias."""
        bias = raised(self.bias, more)
        if torch.is_grad_enabled() or x.dtype != torch.float32 or x.device.type != "cpu":
            return self._conv_forward(x, self.weight, bias)
        if self.kernel_size == (1, 1, 1):
            product = F.linear(x.permute(0, 2, 3, 4, 1), self.weight.flatten(1), bias)
            return product.permute(0, 4, 1, 2, 3)
        if self.in_channels % EIGHT == 0:
            return self._conv_forward(x, self.weight, bias)
        missing = (0,) * 7 + (-self.in_channels % EIGHT,)
        return self._conv_forward(F.pad(x, missing), F.pad(self.weight, missing), bias)


def raised(bias: Tensor | None, more: Tensor | None) -> Tensor | None:
    """Return the sum of two biases, either of which may be missing."""
    return more if bias is None else bias if more is None else bias + more


def convolution(inputs: int, outputs: int, size: int, stride: int = 1) -> nn.Conv3d:
    """Return a convolution that keeps the size of its input, or divides it by ``stride``."""
    layer = Convolution(inputs, outputs, size, stride, size // 2 if stride == 1 else 0)
    nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
    assert layer.bias is not None
    nn.init.zeros_(layer.bias)
    return layer


def silent(layer: nn.Conv3d) -> nn.Conv3d:
    """Return the layer with weights of zero: what it adds to has to be learned."""
    nn.init.zeros_(layer.weight)
    return layer


def summed(total: Tensor, more: Tensor) -> Tensor:
    """Return the sum, in use in place of ``total``: a new array's memory takes longer than it."""
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
        self.second = silent(convolution(width, width, 3))

    def forward(self, x: Tensor) -> Tensor:
        return F.relu_(summed(self.second(F.relu_(self.first(x))), x))


def blocks(width: int, count: int) -> nn.Sequential:
    """Return ``count`` residual blocks."""
    return nn.Sequential(*(ResidualBlock(width) for _ in range(count)))


class Modulation(nn.Module):
    """Scale and shift features by a latent; the identity where the latent is zero."""

    def __init__(self, latent: int, width: int) -> None:
        super().__init__()
        self.scale = silent(nn.Conv3d(latent, width, 1, bias=False))
        self.shift = nn.Conv3d(latent, width, 1, bias=False)

    def forward(self, x: Tensor, latent: Tensor) -> Tensor:
        fine = F.interpolate(latent, size=x.shape[2:], mode="trilinear").to(x.dtype)
        return x * (1 + self.scale(fine)) + self.shift(fine)


class Encoding(NamedTuple):
    """Half of a pass: ``features`` of each level, finest first; ``flow``, the strokes' diffused."""

    features: list[Tensor]
    flow: Tensor


class Draft(NamedTuple):
    """``output`` ``(B, 5, x, y, z)`` and ``features`` at half its resolution, for the detail."""

    output: Tensor
    features: Tensor


class DraftNetwork(nn.Module):
    """A residual 3D U-Net: condition and latent -> logit, distance, velocity of the whole box.

    The encoder sees no latent, so one encoding serves several latents. The latent enters every
    level of the decoder.
    """

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        widths = config.widths
        pairs = list(itertools.pairwise(widths))
        inputs = CHANNELS + 1 + 3 + len(NEARNESS)
        self.stem = convolution(inputs, widths[0], 2, 2)
        self.downs = nn.ModuleList(convolution(fine, coarse, 2, 2) for fine, coarse in pairs)
        self.encoder = nn.ModuleList(map(blocks, widths, config.encoder_blocks))
        self.ups = nn.ModuleList(convolution(coarse, fine, 1) for fine, coarse in pairs)
        self.decoder = nn.ModuleList(map(blocks, widths[:-1], config.decoder_blocks))
        self.modulations = nn.ModuleList(
            Modulation(config.latent_channels, width) for width in widths[:-1]
        )
        self.head = silent(convolution(widths[0], 8 * OUTPUT_CHANNELS, 1))

    def encode(self, crossed: Crossed, obstacle: Tensor | None) -> Encoding:
        """Return what does not depend on the latent; shapes as in :meth:`SplashNetwork.draft`."""
        blocks = in_blocks(crossed)
        flow = diffused_velocity(blocks)
        x = F.relu(self.begin(crossed, obstacle, flow, nearness(blocks)))
        features = []
        for level, residual in enumerate(self.encoder):
            if level:
                x = F.relu(self.downs[level - 1](x))  # (B, 2C, x/2, y/2, z/2)
            x = residual(x)
            features.append(x)
        return Encoding(features, flow)

    def begin(
        self, crossed: Crossed, obstacle: Tensor | None, flow: Tensor, near: Tensor
    ) -> Tensor:
        """Return the stem of the condition, the obstacle, the flow and the nearness.

        As one convolution would, of all of them side by side, in a fourth of its time.
        """
        around = flow.new_zeros(len(flow), *flow.shape[2:], EIGHT).permute(0, 4, 1, 2, 3)
        if obstacle is not None:
            around[:, :1] = obstacle
        around[:, 1:4], around[:, 4 : 4 + len(NEARNESS)] = flow, near
        kernel = self.stem.weight[:, CHANNELS:]
        kernel = F.pad(kernel, (0,) * 7 + (EIGHT - kernel.shape[1],))
        felt = F.conv3d(around.to(kernel.dtype), kernel, self.stem.bias, stride=2)
        return patches(self.stem, crossed, felt)

    def decode(self, encoding: Encoding, latent: Tensor | None) -> Draft:
        """Return the draft for a latent ``(B, L, l, l, l)``; None is the latent zero.

        The head corrects the strokes' diffused velocity: left to find it by itself, a network
        takes long to carry so few crossed cells through the liquid.
        """
        x = encoding.features[-1]
        for level in reversed(range(len(self.decoder))):
            x = F.interpolate(self.ups[level](x), scale_factor=2, mode="nearest")
            x = F.relu_(summed(x, encoding.features[level]))
            if latent is not None:
                x = self.modulations[level](x, latent)
            x = self.decoder[level](x)
        output = pixel_shuffle(self.head(x)).float()
        output[:, 2:] += encoding.flow
        return Draft(output, x)


class DetailNetwork(nn.Module):
    """Condition on fine cells and the draft around them -> all outputs on the fine cells.

    It looks at its neighbourhood only: it may be trained and used on any part of the box.
    """

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        fine, coarse = config.detail_widths
        self.stem = convolution(CHANNELS, fine, 2, 2)
        self.from_output = convolution(OUTPUT_CHANNELS, fine, 3)
        self.from_features = convolution(config.widths[0], coarse, 1)
        self.down = convolution(fine, coarse, 2, 2)
        self.encoder = blocks(fine, config.detail_blocks[0])
        self.middle = blocks(coarse, config.detail_blocks[1])
        self.up = convolution(coarse, fine, 1)
        self.decoder = blocks(fine, config.detail_blocks[2])
        self.head = silent(convolution(fine, 8 * OUTPUT_CHANNELS, 1))

    def forward(self, crossed: Crossed, draft: Draft) -> Tensor:
        """Return ``(B, 5, X, Y, Z)``.

        crossed : of a condition ``(B, 18, X, Y, Z)``; draft : of the same part of the box, at
        half (output) and a quarter (features) of the resolution.
        """
        dtype = self.stem.weight.dtype
        logit, rest = torch.split(draft.output, [1, OUTPUT_CHANNELS - 1], dim=1)
        shown = torch.cat([torch.tanh(logit / 4), rest], dim=1)
        # The bias of the stem goes with this one's: by itself it would take a pass of its own.
        felt = self.from_output(shown.to(dtype), self.stem.bias)
        x = patches(self.stem, crossed, felt.to(dtype))
        x = self.encoder(F.relu_(x))
        y = F.relu_(summed(self.down(x), self.from_features(draft.features)))
        y = F.interpolate(self.up(self.middle(y)), scale_factor=2, mode="nearest")
        x = self.decoder(F.relu_(summed(y, x)))
        return pixel_shuffle(self.head(x), draft.output)


class SplashNetwork(nn.Module):
    """Both networks. Velocities are over the velocity scale, distances over AIR."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        self.coarse = DraftNetwork(config)
        self.detail = DetailNetwork(config)

    def draft(
        self, crossed: Crossed, latent: Tensor | None = None, obstacle: Tensor | None = None
    ) -> Draft:
        """Return the draft of a whole box.

        crossed : of a condition ``(B, 18, x, y, z)``, multiples of 16; latent :
        ``(B, L, l, l, l)`` on the part of its lattice that the box covers, None for the latent
        zero; obstacle : ``(B, 1, x, y, z)`` of :func:`condition.closeness`, None where there is
        none or it is not known.
        """
        draft: Draft = self.coarse.decode(self.coarse.encode(crossed, obstacle), latent)
        return draft

    def forward(
        self, condition: Tensor, latent: Tensor | None = None, obstacle: Tensor | None = None
    ) -> Tensor:
        """Return ``(B, 5, X, Y, Z)`` at full resolution, as ``condition``, multiples of 32.

        obstacle : ``(B, 1, X / 2, Y / 2, Z / 2)``, see :meth:`draft`.
        """
        crossed = crossed_cells(condition)
        output: Tensor = self.detail(crossed, self.draft(halved(crossed), latent, obstacle))
        return output
