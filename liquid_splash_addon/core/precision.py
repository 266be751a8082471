# SPDX-License-Identifier: GPL-3.0-or-later
"""Which number format a device computes the networks fastest in."""

from __future__ import annotations

import time

import torch

DTYPES = {"float32": torch.float32, "bfloat16": torch.bfloat16}


def seconds(device: str, dtype: torch.dtype, repeats: int = 3) -> float:
    """Return the least time of a convolution like the networks' own, in seconds."""
    layer = torch.nn.Conv3d(32, 32, 3, padding=1)
    layer = layer.to(device, dtype, memory_format=torch.channels_last_3d)  # type: ignore[call-overload]
    x = torch.ones((1, 32, 32, 32, 32), device=device, dtype=dtype)
    x = x.to(memory_format=torch.channels_last_3d)
    best = float("inf")
    with torch.inference_mode():
        for _ in range(repeats + 1):  # the first one builds kernels
            start = time.perf_counter()
            float(layer(x).sum())  # waits for the device
            best = min(best, time.perf_counter() - start)
    return best


def fastest_precision(device: str) -> str:
    """Return 'bfloat16' where it is at least a quarter faster than 'float32', else that."""
    try:
        half = seconds(device, torch.bfloat16)
    except RuntimeError:  # some devices have no kernel for it
        return "float32"
    return "bfloat16" if half < 0.8 * seconds(device, torch.float32) else "float32"
