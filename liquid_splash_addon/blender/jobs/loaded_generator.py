# SPDX-License-Identifier: GPL-3.0-or-later
"""The loaded generator, kept until the add-on is disabled: loading takes longer than a draft."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...core.generator.generator import Generator

_loaded: dict[tuple[Path, int, str, str], Generator] = {}


def get(path: Path | None, device: str, precision: str = "") -> Generator:
    """Return the generator of the weights file ``path`` (None: the bundled one) on ``device``.

    precision : a key of ``core.generator.precision.PRECISIONS``. If it is empty, or not available
    on this device (as in a file from another machine), the fastest is measured and used.
    Only the last generator is kept: a small GPU has no room for two. Not thread-safe.
    Raises WeightsError, PackageError.
    """
    from ...core.generator.loading import load_fastest
    from ...core.generator.weights_file import default_weights_path

    path = path or default_weights_path()
    # A weights file that was replaced is loaded again.
    changed = path.stat().st_mtime_ns if path.is_file() else 0
    key = (path, changed, device, precision)
    if key not in _loaded:
        free()
        loaded = load_fastest(path, device, precision)
        _loaded[key] = _loaded[(path, changed, device, loaded.precision)] = loaded
    return _loaded[key]


def is_loaded() -> bool:
    """Whether a generator is kept."""
    return bool(_loaded)


def free() -> None:
    """Drop the loaded generator and release its GPU memory."""
    _loaded.clear()
    torch = sys.modules.get("torch")
    if torch is not None and torch.cuda.is_available():
        torch.cuda.empty_cache()
