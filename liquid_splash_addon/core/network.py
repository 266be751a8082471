# SPDX-License-Identifier: GPL-3.0-or-later
"""The generator's network: a residual 3D U-Net with a latent."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torch.nn.utils.fusion import fuse_conv_bn_eval

CONDITION_CHANNELS = 4  # occupancy, velocity x, y, z
OUTPUT_CHANNELS = 5  # occupancy logit, distance, velocity x, y, z

SPARSE = 1e-4
"""Share of crossed cells below which a block's velocity is rather its neighbourhood's."""


@dataclass(frozen=True)
class NetworkConfig:
    """Everything needed to rebuild a network; written into the weights' header.

    Attributes
    ----------
    widths : channels of each level; the first level has half the grid's resolution
    encoder_blocks, decoder_blocks : residual blocks of each level (the decoder has one level less)
    latent_channels : channels of the latent
    latent_cells : cells of the latent's lattice along each side of the local box
    norm : batch norm (training); exported networks have it folded into the convolutions
    """

    widths: tuple[int, ...] = (16, 32, 64, 128)
    encoder_blocks: tuple[int, ...] = (1, 1, 2, 2)
    decoder_blocks: tuple[int, ...] = (1, 1, 1)
    latent_channels: int = 8
    latent_cells: int = 8
    norm: bool = True


def convolution(inputs: int, outputs: int, size: int, stride: int, norm: bool) -> nn.Module:
    """Return a convolution, with batch norm behind it if ``norm``."""
    padding = size // 2 if stride == 1 else 0
    layer = nn.Conv3d(inputs, outputs, size, stride, padding, bias=not norm)
    return nn.Sequential(layer, nn.BatchNorm3d(outputs)) if norm else nn.Sequential(layer)


class ResidualBlock(nn.Module):
    """Two 3^3 convolutions around a shortcut."""

    def __init__(self, width: int, norm: bool) -> None:
        super().__init__()
        self.first = convolution(width, width, 3, 1, norm)
        self.second = convolution(width, width, 3, 1, norm)

    def forward(self, x: Tensor) -> Tensor:
        return F.relu(x + self.second(F.relu(self.first(x))))


class Modulation(nn.Module):
    """Scale and shift features by a latent; the identity where the latent is zero."""

    def __init__(self, latent: int, width: int) -> None:
        super().__init__()
        self.scale = nn.Conv3d(latent, width, 1, bias=False)
        self.shift = nn.Conv3d(latent, width, 1, bias=False)

    def forward(self, x: Tensor, latent: Tensor) -> Tensor:
        return x * (1 + self.scale(latent)) + self.shift(latent)


class Encoding(NamedTuple):
    """Half of a pass: ``features`` of each level, finest first; ``flow``, the strokes' diffused."""

    features: list[Tensor]
    flow: Tensor


class SplashNetwork(nn.Module):
    """Condition and latent -> logit, distance, velocity, all on the condition's grid.

    The encoder sees no latent, so one encoding serves several latents. The latent enters at
    the decoder's coarsest level, which is never coarser than the latent's lattice.
    """

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        widths, norm = config.widths, config.norm
        levels = range(len(widths))
        self.stem = convolution(CONDITION_CHANNELS + 1, widths[0], 2, 2, norm)
        self.downs = nn.ModuleList(
            convolution(widths[i - 1], widths[i], 2, 2, norm) for i in levels if i
        )
        self.encoder = nn.ModuleList(
            nn.Sequential(*(ResidualBlock(widths[i], norm) for _ in range(n)))
            for i, n in enumerate(config.encoder_blocks)
        )
        self.ups = nn.ModuleList(
            convolution(widths[i + 1], widths[i], 1, 1, norm) for i in levels[:-1]
        )
        self.decoder = nn.ModuleList(
            nn.Sequential(*(ResidualBlock(widths[i], norm) for _ in range(n)))
            for i, n in enumerate(config.decoder_blocks)
        )
        self.modulation = Modulation(config.latent_channels, widths[-2])
        self.head = nn.Conv3d(widths[0], 8 * OUTPUT_CHANNELS, 1)

    def encode(self, condition: Tensor, scale: Tensor) -> Encoding:
        """Return what does not depend on the latent.

        condition : ``(B, 4, X, Y, Z)``, velocity over the velocity scale; scale : ``(B,)``,
        log2 of the cell size over the full-resolution cell size.
        """
        size = scale[:, None, None, None, None].expand(-1, 1, *condition.shape[2:])
        x = F.relu(self.stem(torch.cat([condition, size.to(condition.dtype)], dim=1)))
        features = []
        for level, blocks in enumerate(self.encoder):
            if level:
                x = F.relu(self.downs[level - 1](x))  # (B, 2C, X/2, Y/2, Z/2)
            x = blocks(x)
            features.append(x)
        return Encoding(features, diffused_velocity(condition))

    def decode(self, encoding: Encoding, latent: Tensor | None) -> Tensor:
        """Return ``(B, 5, X, Y, Z)``: logit, distance / AIR, velocity / velocity scale.

        The head corrects the strokes' diffused velocity: left to find it by itself, a network
        takes long to carry so few crossed cells through the liquid.

        latent : ``(B, L, l, l, l)`` on the part of its lattice that the grid covers; None is
        the latent zero.
        """
        features = encoding.features
        x = features[-1]
        for level in reversed(range(len(self.decoder))):
            x = F.interpolate(self.ups[level](x), scale_factor=2, mode="nearest")
            x = F.relu(x + features[level])
            if latent is not None and level == len(self.decoder) - 1:
                fine = F.interpolate(latent, size=x.shape[2:], mode="trilinear")
                x = self.modulation(x, fine)
            x = self.decoder[level](x)
        out = unfold(self.head(x))
        return torch.cat([out[:, :2], out[:, 2:] + encoding.flow], dim=1)

    def forward(self, condition: Tensor, scale: Tensor, latent: Tensor | None = None) -> Tensor:
        """Return :meth:`decode` of :meth:`encode`."""
        return self.decode(self.encode(condition, scale), latent)


def diffused_velocity(condition: Tensor) -> Tensor:
    """Return the strokes' velocity spread over the whole grid, ``(B, 3, X, Y, Z)``.

    Push-pull: averages over ever larger blocks, then from coarse to fine the block's own
    average wherever it holds enough of a stroke. condition : ``(B, 4, X, Y, Z)``.
    """
    weight, flow = condition[:, :1], condition[:, 1:]
    levels = []
    while min(weight.shape[2:]) > 1 and not any(n % 2 for n in weight.shape[2:]):
        weight, flow = F.avg_pool3d(weight, 2), F.avg_pool3d(flow, 2)
        levels.append((weight, flow))
    spread = sum_over_cells(flow) / sum_over_cells(weight).clamp_min(1e-9)
    for weight, flow in reversed(levels):
        spread = F.interpolate(spread, size=weight.shape[2:], mode="trilinear")
        spread = (flow + SPARSE * spread) / (weight + SPARSE)
    return F.interpolate(spread, scale_factor=2, mode="trilinear")


def sum_over_cells(x: Tensor) -> Tensor:
    """Return ``(B, C, 1, 1, 1)``."""
    return x.sum((2, 3, 4), keepdim=True)


def unfold(x: Tensor) -> Tensor:
    """Turn ``(B, 8 C, X, Y, Z)`` into ``(B, C, 2X, 2Y, 2Z)``: a 3D pixel shuffle."""
    batch, channels, *shape = x.shape
    x = x.reshape(batch, channels // 8, 2, 2, 2, *shape).permute(0, 1, 5, 2, 6, 3, 7, 4)
    return x.reshape(batch, channels // 8, *(2 * n for n in shape))


def fold_norm(network: SplashNetwork) -> SplashNetwork:
    """Return an equal network without batch norm: its running statistics become weights."""
    network.eval()
    folded = SplashNetwork(replace(network.config, norm=False)).eval()
    source = dict(network.named_modules())
    for name, module in folded.named_modules():
        if isinstance(module, nn.Conv3d):
            norm = source.get(f"{name.rpartition('.')[0]}.1")
            original = source[name]
            if isinstance(norm, nn.BatchNorm3d) and name.endswith(".0"):
                original = fuse_conv_bn_eval(original, norm)
            module.load_state_dict(original.state_dict())
    return folded
