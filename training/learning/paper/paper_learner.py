# SPDX-License-Identifier: GPL-3.0-or-later
"""How the paper's networks are trained (4.3, 4.3.1): a conditional GAN with L1, or L1 alone."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from ...data.batch import Batch
from ..learner import Learner
from ..parallel import average_gradients
from .networks import PAPER_CHANNELS, PaperConfig, PaperDiscriminator, PaperGenerator, answer

ADAM_BETAS = (0.5, 0.999)
"""As in pix2pix; the paper names only the learning rate."""

NORM_BATCHES = 32
"""Batches from which batch norm's statistics are taken at the end."""

NORM_MOMENTUM = 0.1
"""Momentum of batch norm's running statistics until then."""


def target(batch: Batch) -> Tensor:
    """Return the paper's y, ``(B, 4, X, Y, Z)``: occupancy and the velocity inside the liquid."""
    occupied = (batch.box.distance < 0).float()[:, None]
    return torch.cat([occupied, batch.box.velocity * occupied], dim=1)


class PaperLearner(Learner):
    """The paper's generator and, if the config is adversarial, its discriminator.

    The weights drawn first depend on ``seed`` alone. Dropout draws from torch's global random
    numbers, which are seeded too and part of the state. ``precision`` other than float32 is
    autocast's; weights, losses and Adam stay float32. ``layout`` is that of all 3D tensors; on a
    processor contiguous ones are faster.
    """

    def __init__(
        self,
        config: PaperConfig,
        seed: int = 0,
        device: str = "cpu",
        precision: torch.dtype = torch.float32,
        layout: torch.memory_format = torch.contiguous_format,
    ) -> None:
        torch.manual_seed(seed)
        self.config, self.precision, self.layout = config, precision, layout
        self.grids = (config.cells,)
        self.device = torch.device(device)
        self.generator = PaperGenerator(config)
        self.move(self.generator)
        self.optimiser = self.adam(self.generator)
        self.discriminator: PaperDiscriminator | None = None
        if config.adversarial:
            self.discriminator = PaperDiscriminator(config)
            self.move(self.discriminator)
            self.opponent = self.adam(self.discriminator)

    def move(self, network: nn.Module) -> None:
        """Put a network on the device, in the layout."""
        network.to(self.device).to(memory_format=self.layout)  # type: ignore[call-overload]

    def condition(self, batch: Batch) -> Tensor:
        """Return the paper's channels of the batch's condition, ``(B, 4, X, Y, Z)``, dense.

        On the device, in the layout.
        """
        condition = batch.box.condition.to(self.device)
        condition = condition._replace(values=condition.values[:, :PAPER_CHANNELS])
        return condition.dense().contiguous(memory_format=self.layout)

    def adam(self, network: nn.Module) -> torch.optim.Adam:
        """Return the optimiser of one network."""
        rate = self.config.learning_rate
        # Fused, a step on a processor takes a sixth of the time.
        return torch.optim.Adam(network.parameters(), rate, ADAM_BETAS, fused=True)

    def autocast(self) -> torch.autocast:
        """Return the context that networks run in."""
        mixed = self.precision != torch.float32
        return torch.autocast(self.device.type, self.precision if mixed else None, enabled=mixed)

    def step(self, batch: Batch, progress: float, rate: float) -> dict[str, float]:
        """Train on one batch; see :class:`Learner`.

        'l1' is the plain mean over cells and channels, 'adversarial' the generator's share of
        eq. 2, 'loss' what the generator minimises, 'discriminator' what its opponent does. A
        plain U-Net has the first and 'loss' only.
        """
        self.generator.train()
        condition, truth = self.condition(batch), target(batch).to(self.device)
        with self.autocast():
            output = self.generator(condition)
        losses = {}
        if self.discriminator is not None:
            losses["discriminator"] = self.oppose(condition, truth, output.detach(), rate)
        return losses | self.improve(condition, truth, output, rate)

    def oppose(self, condition: Tensor, truth: Tensor, output: Tensor, rate: float) -> float:
        """Train the discriminator to tell the truth from the generator's output."""
        assert self.discriminator is not None
        self.discriminator.requires_grad_(True)
        loss = (self.verdict(condition, truth, 1.0) + self.verdict(condition, output, 0.0)) / 2
        self.descend(loss, self.discriminator, self.opponent, rate)
        return float(loss.detach())

    def improve(
        self, condition: Tensor, truth: Tensor, output: Tensor, rate: float
    ) -> dict[str, float]:
        """Train the generator on its ``output``: towards the truth, and to deceive its opponent."""
        l1 = (output - truth).abs().mean()
        loss, losses = self.config.l1_weight * l1, {"l1": float(l1.detach())}
        if self.discriminator is not None:
            self.discriminator.requires_grad_(False)  # its gradients are not needed here
            adversarial = self.verdict(condition, output, 1.0)  # eq. 2's log(1 - D) saturates
            loss, losses["adversarial"] = loss + adversarial, float(adversarial.detach())
        self.descend(loss, self.generator, self.optimiser, rate)
        return losses | {"loss": float(loss.detach())}

    def verdict(self, condition: Tensor, pair: Tensor, label: float) -> Tensor:
        """Return the cross-entropy of the discriminator's logit and ``label`` (1 is real)."""
        assert self.discriminator is not None
        with self.autocast():
            logit = self.discriminator(condition, pair)
        return F.binary_cross_entropy_with_logits(logit, torch.full_like(logit, label))

    def descend(
        self, loss: Tensor, network: nn.Module, optimiser: torch.optim.Adam, rate: float
    ) -> None:
        """Take one step of Adam."""
        for group in optimiser.param_groups:
            group["lr"] = self.config.learning_rate * rate
        optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        average_gradients(network.parameters())
        optimiser.step()

    @torch.no_grad()
    def finish(self, batches: Iterator[Batch]) -> None:
        """Replace batch norm's statistics by plain means over many batches.

        The running ones follow the last few batches of two and earlier weights.
        """
        norms = [m for m in self.generator.modules() if isinstance(m, nn.BatchNorm3d)]
        for norm in norms:
            norm.reset_running_stats()
            norm.momentum = None
        self.generator.train()
        for batch in islice(batches, NORM_BATCHES):
            with self.autocast():
                self.generator(self.condition(batch))
        for norm in norms:
            norm.momentum = NORM_MOMENTUM

    def predict(self, batch: Batch) -> Tensor:
        """Return the answer to each condition, the same at every call; see :class:`Learner`."""
        with self.autocast():
            return answer(self.generator, self.condition(batch), seed=0)

    def state(self) -> dict[str, Any]:
        """Return the networks, optimisers and random numbers; tensors are not copied."""
        state: dict[str, Any] = {
            "generator": self.generator.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "random": torch.get_rng_state(),
        }
        if self.discriminator is not None:
            state["discriminator"] = self.discriminator.state_dict()
            state["opponent"] = self.opponent.state_dict()
        if self.device.type == "cuda":
            state["device_random"] = torch.cuda.get_rng_state(self.device)
        return state

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from what :meth:`state` returned, on this device or another."""
        self.generator.load_state_dict(state["generator"])
        self.optimiser.load_state_dict(state["optimiser"])
        if self.discriminator is not None:
            self.discriminator.load_state_dict(state["discriminator"])
            self.opponent.load_state_dict(state["opponent"])
        torch.set_rng_state(state["random"].cpu())
        if self.device.type == "cuda" and "device_random" in state:
            torch.cuda.set_rng_state(state["device_random"].cpu(), self.device)
