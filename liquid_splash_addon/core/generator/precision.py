# SPDX-License-Identifier: GPL-3.0-or-later
"""In which number format a device runs the networks fastest."""

from __future__ import annotations

import time
from typing import NamedTuple, TypeVar

import torch

from ..progress import Report

DTYPES = {"float32": torch.float32, "bfloat16": torch.bfloat16}
"""Formats for training."""

WORTHWHILE = 0.8
"""A coarser format is used if it takes at most this share of the time."""

SMALL, LARGE = 8, 32
"""Cells along each side of what is convolved to measure it, roughly and well."""

HOPELESS = 2.0
"""Seconds for LARGE from which a format is of no use on any device."""


class Precision(NamedTuple):
    """A number format: ``dtype``, and whether large convolutions run in ``eight_bits`` instead."""

    dtype: torch.dtype
    eight_bits: bool


PRECISIONS = {name: Precision(dtype, False) for name, dtype in DTYPES.items()} | {
    "int8": Precision(torch.float32, True),
    "int8_bfloat16": Precision(torch.bfloat16, True),
}
"""Formats for inference. Those with eight bits are for processors."""

IN_EIGHT_BITS = {"float32": "int8", "bfloat16": "int8_bfloat16"}
"""The eight-bit variant of each format without."""


Network = TypeVar("Network", bound=torch.nn.Module)


def prepare(network: Network, device: str, precision: str) -> Network:
    """Return the network for inference, moved to the device and converted to the format.

    Raises ValueError where the device has no such format.
    """
    dtype, eight_bits = PRECISIONS[precision]
    if eight_bits:
        if device != "cpu":
            raise ValueError(f"'{precision}' is for processors, not for {device}")
        from .int8_conv import quantize_convolutions

        try:
            quantize_convolutions(network)
        except (AttributeError, NotImplementedError, RuntimeError) as error:
            raise ValueError(f"PyTorch cannot compute in '{precision}' here: {error}") from error
    moved: Network = network.to(device, dtype, memory_format=torch.channels_last_3d).eval()  # type: ignore[call-overload]
    return moved


def seconds(device: str, precision: str, repeats: int = 3) -> float:
    """Return the least time of a convolution like the networks' own, in seconds.

    Infinite where the device has no kernel for it; estimated where it would take too long.
    """
    layers = torch.nn.Sequential(torch.nn.Conv3d(32, 32, 3, padding=1))
    try:
        layers = prepare(layers, device, precision)
        dtype = PRECISIONS[precision].dtype
        # A processor without bfloat16 takes hundreds of times as long: a part of it shows that.
        rough = [once(layers, device, dtype, SMALL) for _ in range(2)][1]
        estimate = rough * (LARGE / SMALL) ** 3
        if estimate > HOPELESS:
            return estimate
        return min(once(layers, device, dtype, LARGE) for _ in range(repeats + 1))
    except (NotImplementedError, RuntimeError, TypeError, ValueError):  # as their kernels say
        return float("inf")


@torch.inference_mode()
def once(layers: torch.nn.Module, device: str, dtype: torch.dtype, side: int) -> float:
    """Return the time of ``layers`` on ``side``^3 cells, in seconds. The first builds kernels."""
    x = torch.ones((1, 32, side, side, side), device=device, dtype=dtype)
    x = x.to(memory_format=torch.channels_last_3d)
    start = time.perf_counter()
    float(layers(x).sum())  # waits for the device
    return time.perf_counter() - start


def measure_all(device: str, report: Report) -> dict[str, float]:
    """Return the least time of a convolution in each of PRECISIONS, as :func:`seconds` does."""
    found = {}
    for number, name in enumerate(PRECISIONS):
        report(f"Measuring {name} on {device}", number / len(PRECISIONS))
        found[name] = seconds(device, name)
    return found


def fastest_precision(device: str) -> str:
    """Return the fastest of DTYPES, see WORTHWHILE."""
    half = seconds(device, "bfloat16")
    return "bfloat16" if half < WORTHWHILE * seconds(device, "float32") else "float32"


def fastest_in_use(device: str) -> str:
    """Return the fastest of PRECISIONS for inference, see WORTHWHILE."""
    plain = fastest_precision(device)
    fewer = IN_EIGHT_BITS[plain]
    return fewer if seconds(device, fewer) < WORTHWHILE * seconds(device, plain) else plain


def is_usable(device: str, precision: str) -> bool:
    """Return whether the device can compute in this format."""
    return precision in PRECISIONS and seconds(device, precision, repeats=0) < float("inf")
