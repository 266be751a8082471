# SPDX-License-Identifier: GPL-3.0-or-later
"""The weights file: safetensors, tensors plus a plain JSON header, never pickles."""

from __future__ import annotations

import hashlib
import importlib.util
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..grid import LOCAL_CELLS, LOCAL_SPACING

if TYPE_CHECKING:
    from .generator import Generator
    from .splash_unet import SplashNetwork

FORMAT = "liquid-splash-generator-6"

REQUIRED = (
    "network", "velocity_scale", "fastest", "thresholds", "local_cells", "local_spacing",
)  # fmt: skip
"""Entries without which a header is not one of ours."""


class WeightsError(ValueError):
    """A weights file that cannot be used; the message says what to do."""


class TorchMissingError(ImportError):
    """torch or safetensors is not installed in this Python."""


def default_weights_path() -> Path:
    """Return where the bundled weights lie."""
    return Path(__file__).resolve().parents[2] / "weights" / "generator.safetensors"


def torch_is_installed() -> bool:
    """Tell whether torch and safetensors can be imported, without importing them."""
    return all(importlib.util.find_spec(name) is not None for name in ("torch", "safetensors"))


def pick_device(wish: str) -> str:
    """Return the torch device for a ``SplashSettings.device``; WeightsError if there is none."""
    import torch

    found = {
        "CUDA": torch.cuda.is_available(),
        "MPS": torch.backends.mps.is_available(),
        "CPU": True,
    }
    if wish == "AUTO":
        wish = next(name for name, usable in found.items() if usable)
    if not found[wish]:
        raise WeightsError(f"torch finds no {wish} device here: set Device to Automatic or CPU")
    return wish.lower()


def load_generator(
    path: Path | None = None, device: str = "AUTO", precision: str = "float32"
) -> Generator:
    """Return the generator stored at ``path`` (the bundled one by default).

    device : one of ``SplashSettings.device``. precision : a key of ``precision.PRECISIONS``.

    Raises TorchMissingError, WeightsError for a file that is missing, damaged or not ours, or
    ValueError for a precision that the device does not have (``precision.is_usable``).
    """
    if not torch_is_installed():
        raise TorchMissingError("PyTorch and safetensors are not installed in Blender's Python")
    try:
        import torch  # noqa: F401 (its libraries may fail to load where it is installed)
    except (ImportError, OSError) as error:
        raise TorchMissingError(f"PyTorch is installed but does not load: {error}") from error
    path = default_weights_path() if path is None else Path(path)
    data = read_file(path)
    header = read_header(data, path)
    return build(data, header, path, pick_device(device), precision)


def read_file(path: Path) -> bytes:
    """Return the bytes of ``path``; WeightsError if there are none."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise WeightsError(
            f"No weights at {path} ({error.strerror}): choose another file in the preferences "
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
    """Return the error that says so of the file at ``path``."""
    return WeightsError(
        f"{path} is damaged or no weights file of Liquid Splash: install the add-on again "
        "or choose another file in the preferences"
    )


def check_format(metadata: dict[str, str], expected: str, path: Path) -> None:
    """Raise WeightsError where a file is of another format than ``expected``."""
    if metadata.get("format") != expected:
        raise WeightsError(
            f"{path} has the format {metadata.get('format')!r}, this version reads {expected!r}: "
            "choose weights made for it"
        )


def read_header(data: bytes, path: Path) -> dict[str, Any]:
    """Return our header out of a safetensors file; WeightsError if it holds none."""
    metadata = read_metadata(data, path)
    try:
        header = json.loads(metadata["header"])
    except (ValueError, KeyError) as error:
        raise damaged(path) from error
    check_format(metadata, FORMAT, path)
    if not isinstance(header, dict) or any(name not in header for name in REQUIRED):
        raise damaged(path)
    if (header["local_cells"], header["local_spacing"]) != (LOCAL_CELLS, LOCAL_SPACING):
        raise WeightsError(
            f"{path} was trained on another box ({header['local_cells']} cells of "
            f"{header['local_spacing']} m): choose weights made for this version"
        )
    return header


def build(
    data: bytes, header: dict[str, Any], path: Path, device: str, precision: str
) -> Generator:
    """Return the generator with the tensors in ``data``."""
    import torch
    from safetensors import SafetensorError
    from safetensors.torch import load

    from .generator import Generator
    from .splash_unet import NetworkConfig, SplashNetwork

    shape: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in header["network"].items()
    }
    try:
        network = SplashNetwork(NetworkConfig(**shape))
        tensors = {name: tensor.to(torch.float32) for name, tensor in load(data).items()}
        network.load_state_dict(tensors)
    except (SafetensorError, RuntimeError, TypeError, IndexError) as error:
        raise WeightsError(
            f"{path} is damaged (its tensors do not fit its header): install the add-on again"
        ) from error
    # The tensors' own hash: figures are written into the header after they were measured.
    start = 8 + int.from_bytes(data[:8], "little")
    digest = hashlib.sha256(data[start:]).hexdigest()
    return Generator(network, header, digest, device, precision)


def save_weights(network: SplashNetwork, header: dict[str, Any], path: Path) -> None:
    """Write a network as float16, with ``header`` (plain JSON) beside it."""
    import torch
    from safetensors.torch import save_file

    header = {**header, "network": asdict(network.config)}
    tensors = {k: v.to(torch.float16).contiguous() for k, v in network.state_dict().items()}
    save_file(tensors, path, {"format": FORMAT, "header": json.dumps(header)})
