# SPDX-License-Identifier: GPL-3.0-or-later
"""How our own generator is trained: both networks together, latents by conditional IMLE."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from liquid_splash_addon.core.generator.latent import candidates
from liquid_splash_addon.core.generator.splash_unet import (
    Draft,
    Encoding,
    NetworkConfig,
    SplashNetwork,
)

from ..command_line import option
from ..data.batch import Batch
from .learner import Learner
from .losses import sample_losses
from .optimising import Optimiser, follow
from .parallel import average_gradients


@dataclass(frozen=True)
class SplashConfig:
    """How our generator is trained."""

    learning_rate: float = option(2e-3, "Muon's and AdamW's")
    weight_decay: float = option(1e-2, "Muon's and AdamW's")
    average: float = option(0.998, "share of the weights' average kept at each step (EMA)")
    imle_from: float = option(0.5, "share of the run after which latents are trained")
    candidates: int = option(8, "latents tried for each sample; the best is trained (IMLE)")
    deterministic: float = option(0.33, "share of batches with latent zero from then on")


class SplashLearner(Learner):
    """The trained networks, their moving average (the one that is used) and the optimiser.

    cells : side of the draft's box; details are learned at twice the resolution.
    """

    def __init__(
        self,
        config: SplashConfig,
        shape: NetworkConfig,
        cells: int = 64,
        device: str = "cpu",
        precision: torch.dtype = torch.float32,
        seed: int = 0,
    ) -> None:
        torch.manual_seed(seed)
        self.config, self.device, self.precision = config, device, precision
        self.grids = (cells, 2 * cells)
        self.network = SplashNetwork(shape).to(device, memory_format=torch.channels_last_3d)  # type: ignore[call-overload]
        self.average = copy.deepcopy(self.network).eval()
        self.optimiser = Optimiser(self.network, config.learning_rate, config.weight_decay)
        self.random = torch.Generator().manual_seed(seed)
        self.steps = 0

    def start_from(self, weights: Mapping[str, Tensor]) -> None:
        """Begin with the weights of an earlier run, and a new optimiser."""
        self.network.load_state_dict(weights)
        self.average.load_state_dict(weights)

    def step(self, batch: Batch, progress: float, rate: float) -> dict[str, float]:
        """Train on one batch; see :class:`Learner`. Losses: 'loss', 'draft', 'detail'."""
        batch = batch.to(self.device)
        with self.autocast():
            encoding = self.network.coarse.encode(batch.box.condition, batch.obstacle)
            latent = self.choose_latent(encoding, batch, progress)
            draft = self.network.coarse.decode(encoding, latent)
            detail = self.detail(self.network, batch, draft)
        losses = {"draft": sample_losses(draft.output.float(), batch.box).mean()}
        if detail is not None and batch.detail is not None:
            losses["detail"] = sample_losses(detail.float(), batch.detail).mean()
        losses["loss"] = torch.stack(list(losses.values())).sum()
        losses["loss"].backward()  # type: ignore[no-untyped-call]
        average_gradients(self.network.parameters())
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
        self.optimiser.step(rate)
        self.steps += 1
        follow(self.average, self.network, self.config.average, self.steps)
        return {name: float(loss.detach()) for name, loss in losses.items()}

    def autocast(self) -> torch.autocast:
        """Return the context in which the networks run."""
        on = self.precision != torch.float32
        return torch.autocast(self.device, self.precision if on else torch.bfloat16, enabled=on)

    @staticmethod
    def detail(network: SplashNetwork, batch: Batch, draft: Draft) -> Tensor | None:
        """Return the detail network's output on the batch's parts; None where it has none."""
        if batch.detail is None or batch.start is None:
            return None
        size = batch.detail.distance.shape[-1]
        part = Draft(
            crop_each(draft.output, batch.start // 2, size // 2),
            crop_each(draft.features, batch.start // 4, size // 4),
        )
        output: Tensor = network.detail(batch.detail.condition, part)
        return output

    def choose_latent(self, encoding: Encoding, batch: Batch, progress: float) -> Tensor | None:
        """Return the latent to train each sample with, ``(B, L, l, l, l)``; None is zero.

        Several are drawn as consecutive seeds have them; the one whose draft is nearest to the
        truth is trained (conditional IMLE).
        """
        lot = torch.rand((), generator=self.random).item()
        if progress < self.config.imle_from or lot < self.config.deterministic:
            return None
        rng = np.random.default_rng(int(torch.randint(2**62, (), generator=self.random)))
        each = [
            candidates(self.network.config, self.config.candidates, rng)
            for _ in range(len(batch.box.distance))
        ]
        tries = torch.from_numpy(np.stack(each, axis=1)).to(self.device)  # (K, B, L, l, l, l)
        with torch.no_grad():
            losses = [
                sample_losses(self.network.coarse.decode(encoding, z).output.float(), batch.box)
                for z in tries
            ]
        best = torch.stack(losses).argmin(0)
        return tries[best, torch.arange(len(best), device=best.device)]

    def finish(self, batches: Iterator[Batch]) -> None:
        """Do nothing: there are no statistics of norms."""

    @torch.inference_mode()
    def predict(self, batch: Batch) -> Tensor:
        """Return the averaged networks' deterministic answer; see :class:`Learner`."""
        condition = batch.box.condition.to(self.device)
        with self.autocast():
            if condition.shape[-1] == self.grids[0]:
                output = self.average.draft(condition).output.float()
            else:
                output = self.average(condition).float()
        return torch.cat([torch.sigmoid(output[:, :1]), output[:, 2:]], dim=1)

    def state(self) -> dict[str, Any]:
        """Networks, optimiser and random numbers; see :class:`Learner`."""
        return {
            "network": self.network.state_dict(),
            "average": self.average.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "random": self.random.get_state(),
            "steps": self.steps,
            "shape": asdict(self.network.config),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state; see :class:`Learner`."""
        self.network.load_state_dict(state["network"])
        self.average.load_state_dict(state["average"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.random.set_state(state["random"].cpu())
        self.steps = state["steps"]


def crop_each(x: Tensor, start: Tensor, size: int) -> Tensor:
    """Return a cube of each sample, ``(B, C, size, size, size)``.

    x : ``(B, C, X, Y, Z)``; start : ``(B, 3)``, the first cell of each cube.
    """
    return torch.stack(
        [
            sample[:, i : i + size, j : j + size, k : k + size]
            for sample, (i, j, k) in zip(x, start.tolist(), strict=True)
        ]
    )
