# SPDX-License-Identifier: GPL-3.0-or-later
"""The generator: a condition and a latent become a volumetric splash (paper, 4.3)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from ..condition.voxelize import Condition, voxelize
from ..grid import LOCAL_SPACING, Grid
from ..liquid.fields import AIR, Fields, clip_to_band
from ..sketch.strokes import Stroke
from .patch_classifier import PatchClassifier, patch_samples
from .precision import prepare
from .sparse import SparseCondition, closeness, halved
from .splash_unet import Draft, NetworkConfig, SplashNetwork

FAINT_LIQUID = 0.01
"""Probability of liquid in a draft's cell up to which it needs no detail."""

DETAIL_MARGIN = 6
"""Draft cells around those that need detail for which it is computed too; beyond is air. Compared
with computing the whole box, no occupied cell of the bundled sketches' splashes changes."""

GRID_MULTIPLE = {False: 16, True: 32}
"""Cells that a side must be a multiple of, for a draft and at full resolution."""


class Generator:
    """A network ready for use.

    Attributes
    ----------
    header : what training wrote beside the weights (see ``weights_file``)
    weights_hash : SHA-256 of the weights' tensors, hexadecimal
    device : where it runs, a torch device name
    precision : number format it runs in, a key of ``precision.PRECISIONS``
    classifier : tells which patches of a sketch lie in liquid; None where the network is given
        conditions that were made elsewhere
    """

    def __init__(
        self,
        network: SplashNetwork,
        header: dict[str, Any],
        weights_hash: str,
        device: str,
        precision: str = "float32",
        classifier: PatchClassifier | None = None,
    ) -> None:
        self.network = prepare(network, device, precision)
        self.header = header
        self.weights_hash = weights_hash
        self.device = device
        self.precision = precision
        self.classifier = classifier

    @property
    def config(self) -> NetworkConfig:
        """Shape of the network."""
        return self.network.config

    @property
    def fastest(self) -> float:
        """Highest stroke speed seen in training, m/s."""
        return float(self.header["fastest"])

    def condition(self, strokes: Sequence[Stroke], grid: Grid) -> Condition:
        """Return what the network is shown of ``strokes`` (local metres, m/s) on ``grid``."""
        if self.classifier is None:
            raise ValueError("this generator has no patch classifier: give it conditions instead")
        return voxelize(strokes, grid, patch_samples(strokes, self.classifier))

    @torch.inference_mode()
    def generate(
        self,
        condition: Condition,
        grid: Grid,
        latent: np.ndarray | None = None,
        obstacle: np.ndarray | None = None,
    ) -> Fields:
        """Return the splash for ``condition`` on ``grid``.

        Cells larger than 1.5 times the local grid's are a draft's: the first network alone.

        condition : of ``voxelize`` on the grid, whose sides are multiples of 32, of 16
        in a draft.
        latent : float32 ``(L, l, l, l)`` of ``latent.draw_latent``; None is the deterministic
        answer.
        obstacle : signed distance in cells ``(X, Y, Z)``; the liquid avoids it, but may reach
        into it.

        Raises ValueError for a shape that does not fit.
        """
        fine = grid.spacing < 1.5 * LOCAL_SPACING
        if any(n % GRID_MULTIPLE[fine] for n in condition.shape):
            raise ValueError(
                f"the grid must be a multiple of {GRID_MULTIPLE[fine]} cells, not {condition.shape}"
            )
        if obstacle is not None and obstacle.shape != condition.shape:
            raise ValueError(f"the obstacle's grid {obstacle.shape} is not {condition.shape}")
        scale = float(self.header["velocity_scale"])
        crossed = SparseCondition.of(condition).scaled(scale, self.fastest)
        crossed = crossed.to(self.device)
        near = None
        if obstacle is not None:
            near = closeness(self.tensor(obstacle[None]), grid.spacing)
        drawn = None if latent is None else self.tensor(latent)
        if fine:
            output, start = self.full(crossed, drawn, near)
        else:
            output, start = self.network.draft(crossed, drawn, near).output[0], (0, 0, 0)
        threshold = float(self.header["thresholds"]["detail" if fine else "draft"])
        occupancy = torch.sigmoid(output[0] - math.log(threshold / (1 - threshold))).cpu().numpy()
        reach = AIR * min(LOCAL_SPACING / grid.spacing, 1.0)
        distance = (output[1] * AIR).cpu().numpy()
        velocity = (output[2:] * scale).cpu().numpy()
        return clip_to_band(occupancy, distance, velocity, grid, reach, start)

    def tensor(self, array: np.ndarray) -> Tensor:
        """Return a copy of an array as a batch of one on the device."""
        return torch.tensor(array, dtype=torch.float32, device=self.device)[None]

    def full(
        self, crossed: SparseCondition, latent: Tensor | None, near: Tensor | None
    ) -> tuple[Tensor, tuple[int, int, int]]:
        """Return the output ``(5, x, y, z)`` at full resolution, where there may be liquid.

        crossed : velocities over the velocity scale; near : ``(1, 1, X, Y, Z)``. The second
        result is the cell where that part begins.
        """
        strokes = halved(crossed)
        near = None if near is None else F.avg_pool3d(near, 2)
        draft = self.network.draft(strokes, latent, near)
        wanted = torch.sigmoid(draft.output[0, 0]) > FAINT_LIQUID
        wanted[strokes.where[strokes.values[:, 0] > 0][:, 1:].unbind(1)] = True
        box = bounding_box(wanted)
        part = Draft(take(draft.output, box), take(draft.features, grown(box, 0.5)))
        fine = grown(box, 2.0)
        output: Tensor = self.network.detail(crossed.part(fine), part)
        return output[0], (fine[0].start, fine[1].start, fine[2].start)


def bounding_box(wanted: Tensor) -> tuple[slice, ...]:
    """Return slices of the box around the cells that are true, DETAIL_MARGIN wider, of even bounds.

    wanted : bool ``(x, y, z)``; where none is true, the box lies in the middle.
    """
    cells = wanted.nonzero()
    if not len(cells):
        cells = torch.tensor([wanted.shape], device=wanted.device) // 2
    low = (cells.min(0).values - DETAIL_MARGIN).clamp_min(0) // 2 * 2
    high = (cells.max(0).values + 1 + DETAIL_MARGIN + 1) // 2 * 2
    bounds = zip(low.tolist(), high.tolist(), wanted.shape, strict=True)
    return tuple(slice(a, min(b, n)) for a, b, n in bounds)


def take(x: Tensor, box: tuple[slice, ...]) -> Tensor:
    """Return the part of ``(B, C, X, Y, Z)`` in a box, a view."""
    return x[:, :, box[0], box[1], box[2]]


def grown(box: tuple[slice, ...], factor: float) -> tuple[slice, ...]:
    """Return the box on cells ``factor`` times as many."""
    return tuple(slice(int(s.start * factor), int(s.stop * factor)) for s in box)
