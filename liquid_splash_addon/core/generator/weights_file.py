# SPDX-License-Identifier: GPL-3.0-or-later
"""Weights files: safetensors, tensors beside a plain JSON header, never pickles."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..condition.channels import CHANNEL_NAMES, OUTPUT_NAMES
from ..grid import LOCAL_CELLS, LOCAL_SPACING

if TYPE_CHECKING:
    from .splash_unet import SplashNetwork

INPUT_NAMES = [*CHANNEL_NAMES, "obstacle_closeness"]

GENERATOR_FORMAT = "liquid-splash-generator-6"

CHANNELS_HEADER = {"input_channels": INPUT_NAMES, "output_channels": list(OUTPUT_NAMES)}
"""Names in a header of the channels that the networks read and write."""

REQUIRED = (
    "network", "velocity_scale", "fastest", "thresholds", "local_cells", "local_spacing",
)  # fmt: skip
"""Entries without which a header is not one of ours."""


class WeightsError(ValueError):
    """A weights file that cannot be used; the message says what to do."""


def default_weights_path() -> Path:
    """Return where the bundled weights lie."""
    return Path(__file__).resolve().parents[2] / "weights" / "generator.safetensors"


def read_file(path: Path) -> bytes:
    """Return the bytes of ``path``; WeightsError if there are none."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise WeightsError(
            f"No network at {path} ({error.strerror}): choose another file in the preferences "
            "or install the add-on again"
        ) from error


def read_metadata(data: bytes, path: Path) -> dict[str, str]:
    """Return what stands beside the tensors in a safetensors file; WeightsError if nothing does."""
    size = int.from_bytes(data[:8], "little")
    try:
        if len(data) < 8 or size > len(data) - 8:
            raise ValueError("shorter than its header says")
        return dict(json.loads(data[8 : 8 + size])["__metadata__"])
    except (ValueError, KeyError, TypeError) as error:
        raise damaged(path) from error


def damaged(path: Path) -> WeightsError:
    """Return the error for a file that is damaged or none of ours."""
    return WeightsError(
        f"{path} is damaged or no network of Liquid Splash: install the add-on again "
        "or choose another file in the preferences"
    )


def check_format(metadata: dict[str, str], expected: str, path: Path) -> None:
    """Raise WeightsError where a file is of another format than ``expected``."""
    if metadata.get("format") != expected:
        raise WeightsError(
            f"{path} has the format {metadata.get('format')!r}, this version reads {expected!r}: "
            "choose a network made for it"
        )


def check_names(metadata: dict[str, str], expected: dict[str, Any], path: Path) -> None:
    """Raise WeightsError where a header names other columns than this version's networks read.

    Older files have no names, and are not refused.
    """
    try:
        header = json.loads(metadata.get("header", "{}"))
        other = [key for key, names in expected.items() if header.get(key, names) != names]
    except (ValueError, AttributeError) as error:
        raise damaged(path) from error
    if other:
        raise WeightsError(
            f"{path} is for other {' and '.join(other).replace('_', ' ')} than this version has: "
            "choose a network made for it"
        )


def tensors_hash(data: bytes) -> str:
    """Return the SHA-256 of a file's tensors alone: headers may be rewritten, tensors stay."""
    return hashlib.sha256(memoryview(data)[8 + int.from_bytes(data[:8], "little") :]).hexdigest()


def read_header(data: bytes, path: Path) -> dict[str, Any]:
    """Return our header out of a safetensors file; WeightsError if it holds none."""
    metadata = read_metadata(data, path)
    try:
        header = json.loads(metadata["header"])
    except (ValueError, KeyError) as error:
        raise damaged(path) from error
    check_format(metadata, GENERATOR_FORMAT, path)
    check_names(metadata, CHANNELS_HEADER, path)
    if not isinstance(header, dict) or any(name not in header for name in REQUIRED):
        raise damaged(path)
    if (header["local_cells"], header["local_spacing"]) != (LOCAL_CELLS, LOCAL_SPACING):
        raise WeightsError(
            f"{path} was trained in another space ({header['local_cells']} voxels of "
            f"{header['local_spacing']} m): choose a network made for this version"
        )
    return header


def save_weights(network: SplashNetwork, header: dict[str, Any], path: Path) -> None:
    """Write a network as float16, with ``header`` (plain JSON) beside it."""
    import torch
    from safetensors.torch import save_file

    header = {**header, **CHANNELS_HEADER, "network": asdict(network.config)}
    tensors = {k: v.to(torch.float16).contiguous() for k, v in network.state_dict().items()}
    save_file(tensors, path, {"format": GENERATOR_FORMAT, "header": json.dumps(header)})
