# SPDX-License-Identifier: GPL-3.0-or-later
"""The generator: a condition and a latent become a volumetric splash (paper, 4.3)."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from .fields import AIR, Fields
from .grid import LOCAL_SPACING, Grid
from .network import NetworkConfig, SplashNetwork
from .voxels import clamp_speed


class Generator:
    """A network ready for use.

    Attributes
    ----------
    header : what training wrote beside the weights (see ``weights``)
    weights_hash : SHA-256 of the weights' tensors, hexadecimal
    device : where it runs, a torch device name
    precision : number format it runs in, 'float32'
    """

    def __init__(
        self, network: SplashNetwork, header: dict[str, Any], weights_hash: str, device: str
    ) -> None:
        self.network = network.to(device).eval()
        self.header = header
        self.weights_hash = weights_hash
        self.device = device
        self.precision = "float32"

    @property
    def config(self) -> NetworkConfig:
        """Shape of the network."""
        return self.network.config

    @property
    def fastest(self) -> float:
        """Highest stroke speed seen in training, m/s."""
        return float(self.header["fastest"])

    @torch.inference_mode()
    def generate(
        self,
        condition: np.ndarray,
        grid: Grid,
        latent: np.ndarray | None = None,
        obstacle: np.ndarray | None = None,
    ) -> Fields:
        """Return the splash for ``condition`` on ``grid``.

        condition : float32 ``(4, X, Y, Z)`` of ``voxels.rasterize``, X, Y, Z multiples of 16.
        latent : float32 ``(L, l, l, l)`` of :func:`draw_latent`; None is the deterministic answer.
        obstacle : signed distance in cells ``(X, Y, Z)``, for weights that take one.

        Raises ValueError for an obstacle that the weights take no notice of, or a shape that
        does not fit.
        """
        if obstacle is not None:
            raise ValueError("these weights take no obstacle: carve it out of the result instead")
        if any(n % 16 for n in condition.shape[1:]):
            raise ValueError(f"the grid must be a multiple of 16 cells, not {condition.shape[1:]}")
        output = self.run(clamp_speed(condition, self.fastest), grid.spacing, latent)
        occupancy = torch.sigmoid(output[0]).cpu().numpy()
        distance = np.clip(output[1].cpu().numpy() * AIR, -AIR, AIR)
        velocity = output[2:].cpu().numpy() * np.float32(self.header["velocity_scale"])
        return settle(occupancy, distance, velocity, grid)

    def run(self, condition: np.ndarray, spacing: float, latent: np.ndarray | None) -> torch.Tensor:
        """Return the network's raw output ``(5, X, Y, Z)``, the threshold folded into the logit."""
        scaled = torch.from_numpy(condition).to(self.device)[None]
        scaled[:, 1:] /= self.header["velocity_scale"]
        scale = torch.tensor([np.log2(spacing / LOCAL_SPACING)], dtype=torch.float32)
        z = None if latent is None else torch.from_numpy(latent).to(self.device)[None]
        output: torch.Tensor = self.network(scaled, scale.to(self.device), z)[0]
        return output


def settle(occupancy: np.ndarray, distance: np.ndarray, velocity: np.ndarray, grid: Grid) -> Fields:
    """Return Fields whose parts agree: occupancy decides where liquid is.

    The distance keeps the sign of 0.5 - occupancy (at least a tenth of a cell where both
    disagree) and the velocity ends AIR cells outside the liquid.
    """
    sign = np.where(occupancy > 0.5, -1.0, 1.0).astype(np.float32)
    agreed = sign * np.maximum(sign * distance, np.float32(0.1))
    near = agreed < AIR - 0.01
    return Fields(occupancy, np.where(near, agreed, np.float32(AIR)), velocity * near, grid)


def draw_latent(config: NetworkConfig, seed: int, variation: float) -> np.ndarray | None:
    """Return the latent of ``seed``, float32 ``(L, l, l, l)``, standard normal times ``variation``.

    The lattice spans the local box, whatever the resolution, device or crop. Variation 0 gives
    None, the deterministic answer.
    """
    if variation == 0:
        return None
    shape = (config.latent_channels, *(config.latent_cells,) * 3)
    normal = np.random.Generator(np.random.PCG64(seed)).standard_normal(shape)
    return (variation * normal).astype(np.float32)
