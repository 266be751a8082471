# SPDX-License-Identifier: GPL-3.0-or-later
"""In which number format a device runs the networks fastest."""

from __future__ import annotations

import time
from typing import NamedTuple, TypeVar

import torch

DTYPES = {"float32": torch.float32, "bfloat16": torch.bfloat16}
"""Formats for training."""

WORTHWHILE = 0.8
"""A coarser format is used if it takes at most this share of the time."""


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

    Infinite where the device has no kernel for it.
    """
    layers = torch.nn.Sequential(torch.nn.Conv3d(32, 32, 3, padding=1))
    best = float("inf")
    try:
        layers = prepare(layers, device, precision)
        x = torch.ones((1, 32, 32, 32, 32), device=device, dtype=PRECISIONS[precision].dtype)
        x = x.to(memory_format=torch.channels_last_3d)
        with torch.inference_mode():
            for _ in range(repeats + 1):  # the first one builds kernels
                start = time.perf_counter()
                float(layers(x).sum())  # waits for the device
                best = min(best, time.perf_counter() - start)
    except (NotImplementedError, RuntimeError, TypeError, ValueError):  # as their kernels say
        return float("inf")
    return best


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
