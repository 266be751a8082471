# SPDX-License-Identifier: GPL-3.0-or-later
"""The version of the add-on, which every splash remembers."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from pathlib import Path


@lru_cache
def addon_version() -> str:
    """Read the version from the manifest; an installed package holds it, a checkout has it beside.

    "unknown" where there is no manifest.
    """
    package = Path(__file__).resolve().parents[2]
    for folder in (package, package.parent):
        manifest = folder / "blender_manifest.toml"
        if manifest.is_file():
            return str(tomllib.loads(manifest.read_text(encoding="utf-8"))["version"])
    return "unknown"
