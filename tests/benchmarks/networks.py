# SPDX-License-Identifier: GPL-3.0-or-later
"""Our network beside the paper's: one whole box at 128^3, each at its fastest precision."""

import time
from collections.abc import Callable
from functools import partial

import torch

from liquid_splash_addon.core.condition.channels import CHANNELS, PATCH_CLOSENESS
from liquid_splash_addon.core.generator.precision import (
    IN_EIGHT_BITS,
    PRECISIONS,
    is_usable,
    prepare,
)
from liquid_splash_addon.core.generator.splash_unet import NetworkConfig, SplashNetwork
from tests.core.batches import sparse_condition
from training.learning.paper.networks import PaperConfig, PaperGenerator

CELLS = 128
REPEATS = 3


def least_seconds(run: Callable[[], object]) -> float:
    """Return the least time of some runs, after one that builds the kernels."""
    run()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


@torch.inference_mode()
def fastest(make: Callable[[], torch.nn.Module], sparse: bool) -> float:
    """Return the time of a network on one condition, in its fastest format and layout.

    Half precision is tried by autocast and with the weights themselves in it, eight bits for the
    large convolutions. sparse : the network takes the crossed cells alone.
    """
    condition = (torch.rand(1, CHANNELS, CELLS, CELLS, CELLS) > 0.99).float()
    condition[:, :PATCH_CLOSENESS] *= condition[:, :1] * (
        torch.rand(1, 1, *condition.shape[2:]) > 0.9
    )
    crossed, times = sparse_condition(condition), []
    for layout in (torch.contiguous_format, torch.channels_last_3d):
        network = make().eval().to(memory_format=layout)  # type: ignore[call-overload]
        x = crossed if sparse else condition.contiguous(memory_format=layout)
        times.append(least_seconds(lambda: network(x)))  # noqa: B023 (called at once)
        with torch.autocast("cpu", torch.bfloat16):
            times.append(least_seconds(lambda: network(x)))  # noqa: B023
        half = x if sparse else x.to(torch.bfloat16)
        network = network.to(torch.bfloat16)
        times.append(least_seconds(lambda: network(half)))  # noqa: B023
    for name in filter(partial(is_usable, "cpu"), IN_EIGHT_BITS.values()):
        network = prepare(make(), "cpu", name)
        given = x if sparse else x.to(PRECISIONS[name].dtype)
        times.append(least_seconds(lambda: network(given)))  # noqa: B023
    return min(times)


def measure() -> dict[str, float]:
    """Return this area's numbers."""
    ours = fastest(lambda: SplashNetwork(NetworkConfig()), sparse=True)
    paper = fastest(lambda: PaperGenerator(PaperConfig(CELLS)), sparse=False)
    return {
        "synthesis.network_seconds_128": ours,
        "synthesis.paper_network_seconds_128": paper,
        "synthesis.speedup_over_paper_net": paper / ours,
    }
