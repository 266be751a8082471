# SPDX-License-Identifier: GPL-3.0-or-later
"""Loading a generator from its weights, and choosing the device that it runs on.

torch is imported only where it is used: the add-on must be able to say that it is missing.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..packages import load
from .weights_file import (
    WeightsError,
    default_weights_path,
    read_file,
    read_header,
    tensors_hash,
)

if TYPE_CHECKING:
    from .generator import Generator
    from .patch_classifier import PatchClassifier
    from .splash_unet import SplashNetwork


def load_torch() -> None:
    """Import what the networks need. Raises PackageError where it is missing or broken."""
    for module in ("torch", "safetensors"):
        load(module)


def pick_device(setting: str) -> str:
    """Return the torch device for a ``SplashSettings.device``.

    Raises WeightsError if there is none, PackageError.
    """
    load_torch()
    import torch

    found = {
        "CUDA": torch.cuda.is_available(),
        "MPS": torch.backends.mps.is_available(),
        "CPU": True,
    }
    if setting == "AUTO":
        setting = next(name for name, usable in found.items() if usable)
    if not found[setting]:
        raise WeightsError(f"torch finds no {setting} device here: set Device to Automatic or CPU")
    return setting.lower()


def load_generator(
    path: Path | None = None, device: str = "AUTO", precision: str = "float32"
) -> Generator:
    """Return the generator stored at ``path`` (the bundled one by default).

    device : one of ``SplashSettings.device``. precision : a key of ``precision.PRECISIONS``.

    Its patch classifier is the one beside the weights, or else the bundled one.

    Raises PackageError; WeightsError for a file that is missing, damaged, not ours or of
    another training than its classifier; ValueError for a precision that the device does not
    support (``precision.is_usable``).
    """
    load_torch()
    from .generator import Generator
    from .patch_classifier import load_patch_classifier, patch_classifier_path

    path = default_weights_path() if path is None else Path(path)
    data = read_file(path)
    header = read_header(data, path)
    classifier = load_patch_classifier(patch_classifier_path(path))
    check_tied(header, classifier, path)
    network = build_network(data, header, path)
    digest = tensors_hash(data)
    return Generator(network, header, digest, pick_device(device), precision, classifier)


def load_fastest(path: Path | None, device: str = "AUTO", precision: str = "") -> Generator:
    """Return the generator as :func:`load_generator` does, in the number format ``precision``.

    If that is empty or not available on this device (as in a file from another machine), the
    fastest is measured and used.
    """
    load_torch()
    from .precision import is_usable, known_fastest

    picked = pick_device(device)
    if not precision or not is_usable(picked, precision):
        precision = known_fastest(picked)
    return load_generator(path, device, precision)


def build_network(data: bytes, header: dict[str, Any], path: Path) -> SplashNetwork:
    """Return the network with the tensors in ``data``; WeightsError if they do not fit."""
    import torch
    from safetensors import SafetensorError
    from safetensors.torch import load

    from .layers import Unwritten
    from .splash_unet import NetworkConfig, SplashNetwork

    shape: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in header["network"].items()
    }
    try:
        with Unwritten():  # random weights would take as long as reading these
            network = SplashNetwork(NetworkConfig(**shape))
        tensors = {name: tensor.to(torch.float32) for name, tensor in load(data).items()}
        network.load_state_dict(tensors, assign=True)
    except (SafetensorError, RuntimeError, TypeError, IndexError) as error:
        raise WeightsError(
            f"{path} is damaged (its tensors do not fit its header): install the add-on again"
        ) from error
    return network


def check_tied(header: dict[str, Any], classifier: PatchClassifier, path: Path) -> None:
    """Raise WeightsError where a generator was trained on another classifier's verdicts.

    Generators from before the classifier's tensors were hashed name none, and are not refused.
    """
    if header.get("patch_classifier_hash", classifier.weights_hash) != classifier.weights_hash:
        raise WeightsError(
            f"{path} was trained with another patch classifier than the one beside it: copy both "
            "of the same training"
        )
