# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's own networks (4.3), rebuilt as the reference that ours is measured against.

There is no public code. What the paper leaves open is as in pix2pix (Isola et al. 2017), which
it follows: where norm and dropout stand, the slope of the leaky ReLU, the first weights.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from scipy.special import expit, logit
from torch import Tensor, nn
from torch.nn import functional as F

from liquid_splash_addon.core.condition.voxelize import Condition
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import PHI_CELLS, Fields

from ...data.batch import VELOCITY_SCALE

PAPER_CHANNELS = 4
"""Occupancy and velocity x, y, z, of the input and of the output."""

MULTIPLES = (1, 2, 4, 8, 8, 8, 8)
"""Channels of the generator's levels over its width: 64, 128, 256, 512, 512, 512, 512."""

DROPOUT_LEVELS = 3
"""Innermost levels of the decoder, which have dropout."""

LEAK = 0.2
"""Slope of the leaky ReLU below zero."""


@dataclass(frozen=True)
class PaperConfig:
    """Everything needed to rebuild the networks, and what they are trained with.

    Attributes
    ----------
    cells : side of the grid, a power of two from 16; the paper's is 128
    width : channels of the first level; the paper's is 64
    l1_weight : lambda of eq. 3
    adversarial : train against a discriminator; False is the paper's baseline, a U-Net with L1
    dropout : probability
    learning_rate : Adam's; batches are of two in the paper
    """

    cells: int = 128
    width: int = 64
    l1_weight: float = 100.0
    adversarial: bool = True
    dropout: float = 0.5
    learning_rate: float = 1e-4

    def __post_init__(self) -> None:
        if self.cells < 16 or self.cells & (self.cells - 1):
            raise ValueError(f"cells must be a power of two from 16, not {self.cells}")

    @property
    def widths(self) -> tuple[int, ...]:
        """Channels of the generator's levels; the last has one cell, or is the seventh."""
        levels = self.cells.bit_length() - 1
        return tuple(self.width * multiple for multiple in MULTIPLES[:levels])


def layer(kind: type[nn.Module], inputs: int, outputs: int, norm: bool) -> nn.Sequential:
    """Return a convolution (or transposed one) of 4^3 cells, stride 2, with norm if ``norm``."""
    convolution = kind(inputs, outputs, 4, 2, 1, bias=not norm)
    return nn.Sequential(convolution, *([nn.BatchNorm3d(outputs)] if norm else []))


def initialise(module: nn.Module) -> None:
    """Draw the first weights as pix2pix does."""
    if isinstance(module, nn.Conv3d | nn.ConvTranspose3d | nn.Linear):
        nn.init.normal_(module.weight, 0.0, 0.02)
        if module.bias is not None:
            nn.init.zeros_(module.bias)
    elif isinstance(module, nn.BatchNorm3d):
        nn.init.normal_(module.weight, 1.0, 0.02)
        nn.init.zeros_(module.bias)


class PaperGenerator(nn.Module):
    """A 3D U-Net (paper, 4.3, Fig. 6): condition -> occupancy and velocity on the same grid.

    At 128^3 the seven levels end in one cell. At 64^3 six do: the seventh does not exist and is
    left out. Dropout stays on in use, being the noise z of eq. 2; batch norm uses its running
    statistics in use.
    """

    def __init__(self, config: PaperConfig) -> None:
        super().__init__()
        self.config = config
        widths = config.widths
        last = len(widths) - 1
        self.encoder = nn.ModuleList(
            # One cell has no spread within a sample: no norm there, nor on the input's level.
            layer(nn.Conv3d, inputs, outputs, norm=0 < level < last)
            for level, (inputs, outputs) in enumerate(
                zip((PAPER_CHANNELS, *widths), widths, strict=False)
            )
        )
        self.decoder = nn.ModuleList(
            layer(
                nn.ConvTranspose3d,
                widths[level] * (1 if level == last else 2),
                widths[level - 1] if level else PAPER_CHANNELS,
                norm=level > 0,
            )
            for level in range(len(widths))
        )
        self.apply(initialise)

    def forward(self, condition: Tensor) -> Tensor:
        """Return ``(B, 4, X, Y, Z)``: occupancy 0..1, velocity over the velocity scale.

        The sigmoid is pix2pix's tanh, of half the argument, mapped to 0..1. Velocity, which has
        no bounds, is linear.

        condition : ``(B, 4 or more, X, Y, Z)``, velocity over the velocity scale; X, Y, Z
        multiples of 2^levels. Channels that the paper does not have are ignored.
        """
        x, skips = condition[:, :PAPER_CHANNELS], []
        for level, down in enumerate(self.encoder):
            x = down(F.leaky_relu(x, LEAK) if level else x)
            skips.append(x)
        levels = len(self.decoder)
        for level in reversed(range(levels)):
            x = self.decoder[level](F.relu(x))
            if level >= max(levels - DROPOUT_LEVELS, 1):
                x = F.dropout(x, self.config.dropout, training=True)
            if level:
                x = torch.cat([x, skips[level - 1]], dim=1)
        x = x.float()
        return torch.cat([torch.sigmoid(x[:, :1]), x[:, 1:]], dim=1)


class PaperDiscriminator(nn.Module):
    """Four convolutions and a fully connected layer (paper, 4.3): a pair -> one logit, 'real'."""

    def __init__(self, config: PaperConfig) -> None:
        super().__init__()
        widths = [config.width * multiple for multiple in MULTIPLES[:4]]
        side = config.cells // 2 ** len(widths)
        self.layers = nn.ModuleList(
            layer(nn.Conv3d, inputs, outputs, norm=level > 0 and (level < 3 or side > 1))
            for level, (inputs, outputs) in enumerate(
                zip((2 * PAPER_CHANNELS, *widths), widths, strict=False)
            )
        )
        self.last = nn.Linear(widths[-1] * side**3, 1)
        self.apply(initialise)

    def forward(self, condition: Tensor, output: Tensor) -> Tensor:
        """Return ``(B,)``.

        condition : ``(B, 4 or more, n, n, n)`` with n = the config's cells; output : with 4.
        """
        x = torch.cat([condition[:, :PAPER_CHANNELS], output], dim=1)
        for convolution in self.layers:
            x = F.leaky_relu(convolution(x), LEAK)
        logit: Tensor = self.last(x.flatten(1))[:, 0]
        return logit.float()


@torch.no_grad()
def answer(network: PaperGenerator, condition: Tensor, seed: int) -> Tensor:
    """Return the network's output as in use: running statistics, dropout of ``seed``.

    Other random draws are as if this had not happened.
    """
    network.eval()
    cards = [condition.device] if condition.device.type == "cuda" else []
    with torch.random.fork_rng(cards):
        torch.manual_seed(seed)
        output: Tensor = network(condition)
    return output


class PaperAnswer:
    """The paper's generator, asked as ours is (``core.generator.Generator``).

    Attributes
    ----------
    threshold : output from which a cell is liquid, 0..1; the occupancy is 0.5 there
    """

    def __init__(self, network: PaperGenerator, device: str = "cpu") -> None:
        self.network = network.to(device).eval()
        self.device = device
        self.threshold = 0.5

    @property
    def cells(self) -> int:
        """Side of the grid that it was trained on."""
        return self.network.config.cells

    def generate(
        self, condition: Condition, grid: Grid, latent: np.ndarray | None = None
    ) -> Fields:
        """Return the splash for ``condition`` on ``grid``.

        The distance is the one whose phi (eq. 4) is the occupancy, so it ends 2 cells away.

        latent : any array; it seeds the dropout, the only noise there is. None is seed 0.

        Raises ValueError for another grid than it was trained on.
        """
        if grid.shape != (self.cells,) * 3:
            raise ValueError(
                f"this network was trained on {self.cells}^3 cells, not on {grid.shape}"
            )
        scaled = torch.from_numpy(condition.dense()[:PAPER_CHANNELS]).to(self.device)[None]
        scaled[:, 1:] /= VELOCITY_SCALE
        seed = 0 if latent is None else zlib.crc32(latent.tobytes())
        output = answer(self.network, scaled, seed)[0].cpu().numpy()
        odds = np.log(self.threshold / (1 - self.threshold))
        occupancy = expit(logit(output[0]) - np.float32(odds))
        distance = np.float32(PHI_CELLS) * (np.float32(0.5) - occupancy)
        return Fields(occupancy, distance, output[1:] * np.float32(VELOCITY_SCALE), grid)


def load_paper(run_dir: Path, device: str = "cpu") -> PaperAnswer:
    """Return the generator of a training run; ValueError for a run of another model."""
    state = torch.load(run_dir / "checkpoint.pt", map_location="cpu", weights_only=True)
    if state.get("kind") != "paper":
        raise ValueError(f"{run_dir} is no run of the paper's model")
    network = PaperGenerator(PaperConfig(**state["config"]))
    network.load_state_dict(state["learner"]["generator"])
    return PaperAnswer(network, device)
