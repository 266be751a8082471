# SPDX-License-Identifier: GPL-3.0-or-later
"""The generator's networks: a draft of the whole box, then detail where there is liquid."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from ..condition.channels import CHANNELS, OUTPUT_NAMES
from .layers import (
    CHANNEL_MULTIPLE,
    Modulation,
    convolution,
    in_place_sum,
    residual_blocks,
    zero_initialised,
)
from .pixel_shuffle import pixel_shuffle
from .sparse import (
    NEARNESS,
    SparseCondition,
    block_means,
    diffused_velocity,
    halved,
    nearness,
    strided_stem,
)

OUTPUT_CHANNELS = len(OUTPUT_NAMES)


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


class Encoding(NamedTuple):
    """The encoder's result: ``features``, finest level first; ``flow``, the diffused velocity."""

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
        self.encoder = nn.ModuleList(map(residual_blocks, widths, config.encoder_blocks))
        self.ups = nn.ModuleList(convolution(coarse, fine, 1) for fine, coarse in pairs)
        self.decoder = nn.ModuleList(map(residual_blocks, widths[:-1], config.decoder_blocks))
        self.modulations = nn.ModuleList(
            Modulation(config.latent_channels, width) for width in widths[:-1]
        )
        self.head = zero_initialised(convolution(widths[0], 8 * OUTPUT_CHANNELS, 1))

    def encode(self, crossed: SparseCondition, obstacle: Tensor | None) -> Encoding:
        """Return what does not depend on the latent; shapes as in :meth:`SplashNetwork.draft`."""
        means = block_means(crossed)
        flow = diffused_velocity(means)
        x = F.relu(self.begin(crossed, obstacle, flow, nearness(means)))
        features = []
        for level, residual in enumerate(self.encoder):
            if level:
                x = F.relu(self.downs[level - 1](x))  # (B, 2C, x/2, y/2, z/2)
            x = residual(x)
            features.append(x)
        return Encoding(features, flow)

    def begin(
        self, crossed: SparseCondition, obstacle: Tensor | None, flow: Tensor, near: Tensor
    ) -> Tensor:
        """Return the stem of the condition, the obstacle, the flow and the nearness.

        The same as one convolution of all of them as channels, in a quarter of its time.
        """
        around = flow.new_zeros(len(flow), *flow.shape[2:], CHANNEL_MULTIPLE).permute(0, 4, 1, 2, 3)
        if obstacle is not None:
            around[:, :1] = obstacle
        around[:, 1:4], around[:, 4 : 4 + len(NEARNESS)] = flow, near
        kernel = self.stem.weight[:, CHANNELS:]
        kernel = F.pad(kernel, (0,) * 7 + (CHANNEL_MULTIPLE - kernel.shape[1],))
        felt = F.conv3d(around.to(kernel.dtype), kernel, self.stem.bias, stride=2)
        return strided_stem(self.stem, crossed, felt)

    def decode(self, encoding: Encoding, latent: Tensor | None) -> Draft:
        """Return the draft for a latent ``(B, L, l, l, l)``; None is the latent zero.

        The head corrects the strokes' diffused velocity: by itself, a network takes long to learn
        to carry the velocity of so few crossed cells through the liquid.
        """
        x = encoding.features[-1]
        for level in reversed(range(len(self.decoder))):
            x = F.interpolate(self.ups[level](x), scale_factor=2, mode="nearest")
            x = F.relu_(in_place_sum(x, encoding.features[level]))
            if latent is not None:
                x = self.modulations[level](x, latent)
            x = self.decoder[level](x)
        output = pixel_shuffle(self.head(x)).float()
        output[:, 2:] += encoding.flow
        return Draft(output, x)


class DetailNetwork(nn.Module):
    """Condition on fine cells and the draft around them -> all outputs on the fine cells.

    Its receptive field is small: it may be trained and used on any part of the box.
    """

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        fine, coarse = config.detail_widths
        self.stem = convolution(CHANNELS, fine, 2, 2)
        self.from_output = convolution(OUTPUT_CHANNELS, fine, 3)
        self.from_features = convolution(config.widths[0], coarse, 1)
        self.down = convolution(fine, coarse, 2, 2)
        self.encoder = residual_blocks(fine, config.detail_blocks[0])
        self.middle = residual_blocks(coarse, config.detail_blocks[1])
        self.up = convolution(coarse, fine, 1)
        self.decoder = residual_blocks(fine, config.detail_blocks[2])
        self.head = zero_initialised(convolution(fine, 8 * OUTPUT_CHANNELS, 1))

    def forward(self, crossed: SparseCondition, draft: Draft) -> Tensor:
        """Return ``(B, 5, X, Y, Z)``.

        crossed : of shape ``(B, X, Y, Z)``; draft : of the same part of the box, at
        half (output) and a quarter (features) of the resolution.
        """
        dtype = self.stem.weight.dtype
        logit, rest = torch.split(draft.output, [1, OUTPUT_CHANNELS - 1], dim=1)
        shown = torch.cat([torch.tanh(logit / 4), rest], dim=1)
        # The stem's bias is added to this one's: by itself it would take another pass.
        felt = self.from_output(shown.to(dtype), self.stem.bias)
        x = strided_stem(self.stem, crossed, felt.to(dtype))
        x = self.encoder(F.relu_(x))
        y = F.relu_(in_place_sum(self.down(x), self.from_features(draft.features)))
        y = F.interpolate(self.up(self.middle(y)), scale_factor=2, mode="nearest")
        x = self.decoder(F.relu_(in_place_sum(y, x)))
        return pixel_shuffle(self.head(x), draft.output)


class SplashNetwork(nn.Module):
    """Both networks. Velocities are over the velocity scale, distances over AIR."""

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self.config = config
        self.coarse = DraftNetwork(config)
        self.detail = DetailNetwork(config)

    def draft(
        self, crossed: SparseCondition, latent: Tensor | None = None, obstacle: Tensor | None = None
    ) -> Draft:
        """Return the draft of a whole box.

        crossed : of shape ``(B, x, y, z)``, multiples of 16; latent :
        ``(B, L, l, l, l)`` on the part of its lattice that the box covers, None for the latent
        zero; obstacle : ``(B, 1, x, y, z)`` of :func:`sparse.closeness`, None where there is
        none or it is not known.
        """
        draft: Draft = self.coarse.decode(self.coarse.encode(crossed, obstacle), latent)
        return draft

    def forward(
        self, crossed: SparseCondition, latent: Tensor | None = None, obstacle: Tensor | None = None
    ) -> Tensor:
        """Return ``(B, 5, X, Y, Z)`` at full resolution.

        crossed : of shape ``(B, X, Y, Z)``, multiples of 32; obstacle :
        ``(B, 1, X / 2, Y / 2, Z / 2)``; latent and obstacle : see :meth:`draft`.
        """
        output: Tensor = self.detail(crossed, self.draft(halved(crossed), latent, obstacle))
        return output
