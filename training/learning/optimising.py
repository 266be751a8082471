# SPDX-License-Identifier: GPL-3.0-or-later
"""The optimiser of our generator: Muon for the convolutions inside, AdamW for the rest.

Muon (Jordan et al. 2024) makes each matrix's step orthogonal, so that directions that the loss
seldom asks for are learned as fast as the common ones. Measured here: docs/training.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import torch
from torch import Tensor, nn

INSIDE = ("encoder", "decoder", "middle", "downs", "ups", "down", "up")
"""Modules of the networks whose weights map features to features. Stems, heads and the latent's
layers are not among them: Muon is not made for rows of zeros and few inputs."""

MUON_MOMENTUM = 0.95

ITERATIONS = 5
"""Steps of the iteration that makes a matrix orthogonal."""
A, B, C = 3.4445, -4.7750, 2.0315
"""Its coefficients: steepest at zero (Jordan)."""


def as_matrix(kernel: Tensor) -> Tensor:
    """Return a kernel ``(out, in, k, k, k)`` as ``(out, k * k * k * in)``."""
    return kernel.permute(0, 2, 3, 4, 1).reshape(len(kernel), -1)


def orthogonal(matrix: Tensor) -> Tensor:
    """Return roughly the orthogonal matrix nearest to ``(m, n)``: singular values of 0.7 to 1.2.

    Newton-Schulz iteration with Jordan's coefficients, on the m x m Gram matrix: ``n`` is 8 to 27
    times ``m`` here, and this way it is read twice instead of ten times.
    """
    gram = matrix @ matrix.T
    square = gram.trace().clamp_min(1e-20)
    gram /= square
    one = torch.eye(len(gram), device=gram.device)
    total = one
    for _ in range(ITERATIONS):
        step = A * one + B * gram + C * gram @ gram
        total = step @ total
        gram = step @ gram @ step
    return (total / square.sqrt()) @ matrix


class Muon(torch.optim.Optimizer):
    """Momentum, then a step of orthogonal matrices. torch's own takes no kernels, and was slower.

    Steps are scaled to the size of AdamW's (Liu et al. 2025), so that one learning rate and one
    weight decay serve both.
    """

    def __init__(self, kernels: Iterable[Tensor], lr: float, weight_decay: float) -> None:
        super().__init__(kernels, {"lr": lr, "weight_decay": weight_decay})

    @torch.no_grad()
    def step(self, closure: None = None) -> None:  # type: ignore[override]
        """Move the kernels along their gradients."""
        for group in self.param_groups:
            for kernel in group["params"]:
                if kernel.grad is not None:
                    self.move(kernel, kernel.grad, group["lr"], group["weight_decay"])

    def move(self, kernel: Tensor, grad: Tensor, lr: float, weight_decay: float) -> None:
        """Move one kernel."""
        gradient, momentum = as_matrix(grad), MUON_MOMENTUM
        state = self.state[kernel]
        if "mean" not in state:
            state["mean"] = torch.zeros_like(gradient)
        state["mean"].lerp_(gradient, 1 - momentum)
        ahead = gradient.lerp(state["mean"], momentum)  # Nesterov's
        size = 0.2 * max(ahead.shape) ** 0.5
        step = orthogonal(ahead).view(len(kernel), *kernel.shape[2:], kernel.shape[1])
        kernel.mul_(1 - lr * weight_decay)
        kernel.sub_(step.permute(0, 4, 1, 2, 3), alpha=lr * size)


class Optimiser:
    """Both optimisers as one."""

    def __init__(self, network: nn.Module, learning_rate: float, weight_decay: float) -> None:
        self.learning_rate = learning_rate
        inside, weights, others = parameter_groups(network)
        decaying = {"params": weights, "weight_decay": weight_decay}
        self.muon = Muon(inside, learning_rate, weight_decay)
        self.adam = torch.optim.AdamW(
            [decaying, {"params": others, "weight_decay": 0.0}],
            lr=learning_rate,
            betas=(0.9, 0.99),
            fused=True,
        )

    def step(self, rate: float) -> None:
        """Move the parameters along their gradients, and drop the gradients.

        rate : factor on the learning rate
        """
        for optimiser in (self.muon, self.adam):
            for group in optimiser.param_groups:
                group["lr"] = self.learning_rate * rate
            optimiser.step()
            optimiser.zero_grad(set_to_none=True)

    def state_dict(self) -> dict[str, Any]:
        """Return the state of both, as torch's optimisers do."""
        return {"muon": self.muon.state_dict(), "adam": self.adam.state_dict()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on from a state of :meth:`state_dict`."""
        self.muon.load_state_dict(state["muon"])
        self.adam.load_state_dict(state["adam"])


def parameter_groups(
    network: nn.Module,
) -> tuple[Sequence[nn.Parameter], Sequence[nn.Parameter], Sequence[nn.Parameter]]:
    """Return the kernels for Muon, the other weights, and biases (which do not decay)."""
    inside, weights, others = [], [], []
    for name, parameter in network.named_parameters():
        if parameter.ndim <= 1:
            others.append(parameter)
        elif set(name.split(".")) & set(INSIDE):
            inside.append(parameter)
        else:
            weights.append(parameter)
    return inside, weights, others


@torch.no_grad()
def follow(average: nn.Module, network: nn.Module, decay: float, steps: int) -> None:
    """Move the averaged weights towards those of ``network``, trained for ``steps`` steps.

    decay : what is kept of the average at each step (EMA); less at first.
    """
    keep = min(decay, steps / (steps + 10))
    mine: list[Tensor] = list(average.parameters())
    new: list[Tensor] = list(network.parameters())
    torch._foreach_lerp_(mine, new, 1 - keep)
