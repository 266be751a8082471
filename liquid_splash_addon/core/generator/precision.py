# SPDX-License-Identifier: GPL-3.0-or-later
"""In which number format a device runs the networks fastest."""

from __future__ import annotations

import json
import time
from typing import NamedTuple, TypeVar

import torch

from .. import compiled_code
from ..progress import Report

DTYPES = {"float32": torch.float32, "bfloat16": torch.bfloat16}
"""Formats for training."""

WORTHWHILE = 0.8
"""A coarser format is used if it takes at most this share of the time."""

SMALL, LARGE = 8, 32
"""Cells along each side of what is convolved to measure it, roughly and well."""

HOPELESS = 2.0
"""Seconds for LARGE from which a format is of no use on any device."""

SLOWER = 20.0
"""Times of 32 bits' from which a rough measurement is enough: a processor without bfloat16."""

NEGLIGIBLE = 0.25
"""Seconds that a rough measurement may say of any format: graphics cards take long to start."""

KEPT = "precision"
"""Name of the file that keeps what was measured, beside the compiled code."""


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


def seconds(device: str, precision: str, repeats: int = 3, most: float = HOPELESS) -> float:
    """Return the least time of a convolution like the networks' own, in seconds.

    Infinite where the device has no kernel for it; estimated where it would take over ``most``.
    """
    layers = torch.nn.Sequential(torch.nn.Conv3d(32, 32, 3, padding=1))
    try:
        layers = prepare(layers, device, precision)
        dtype = PRECISIONS[precision].dtype
        # A processor without bfloat16 takes hundreds of times as long: a part of it shows that.
        rough = [once(layers, device, dtype, SMALL) for _ in range(2)][1]
        estimate = rough * (LARGE / SMALL) ** 3
        if estimate > most:
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
    found: dict[str, float] = {}
    for number, name in enumerate(PRECISIONS):
        report(f"Measuring {name} on {device}", number / len(PRECISIONS))
        usual = found.get("float32")
        found[name] = seconds(device, name, most=HOPELESS if usual is None else bearable(usual))
    return found


def fastest_precision(device: str) -> str:
    """Return the fastest of DTYPES, see WORTHWHILE."""
    full = seconds(device, "float32")
    return "bfloat16" if pays(device, "bfloat16", full) else "float32"


def fastest_in_use(device: str) -> str:
    """Return the fastest of PRECISIONS for inference, see WORTHWHILE."""
    plain = fastest_precision(device)
    fewer = IN_EIGHT_BITS[plain]
    return fewer if pays(device, fewer, seconds(device, plain)) else plain


def pays(device: str, precision: str, usual: float) -> bool:
    """Return whether a format takes so much less than ``usual`` seconds that it is worth it."""
    return seconds(device, precision, most=bearable(usual)) < WORTHWHILE * usual


def bearable(usual: float) -> float:
    """Return from how many seconds, roughly measured, a format is not measured to the end.

    usual : what 32 bits take.
    """
    return min(HOPELESS, max(NEGLIGIBLE, SLOWER * usual))


def known_fastest(device: str) -> str:
    """Return :func:`fastest_in_use`, measured once on this machine if that can be kept."""
    folder = compiled_code.folder()
    if folder is None:
        return fastest_in_use(device)
    path = compiled_code.machine_file(folder, KEPT)
    try:
        known = json.loads(path.read_text())
        known = known if isinstance(known, dict) else {}
    except (OSError, ValueError):
        known = {}
    key = device_key(device)
    if known.get(key) not in PRECISIONS:
        known[key] = fastest_in_use(device)
        try:
            path.write_text(json.dumps(known))
        except OSError:  # it will be measured again
            pass
    return str(known[key])


def device_key(device: str) -> str:
    """Return what a measurement holds for: this torch on this card or processor."""
    card = torch.cuda.get_device_name() if device == "cuda" else ""
    return f"{device} {card} {torch.__version__}"


def is_usable(device: str, precision: str) -> bool:
    """Return whether the device can compute in this format."""
    return precision in PRECISIONS and seconds(device, precision, most=0.0) < float("inf")
