# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenVDB's Python module, which comes with Blender."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

import bpy

from .objects import SceneError

NAMES = ("openvdb", "pyopenvdb")
"""Of the module: the second is what it was called before OpenVDB 12."""


def load_openvdb() -> ModuleType:
    """Import OpenVDB's module. Raises SceneError where this Blender has none."""
    for folder in ("", bundled_packages()):
        for name in NAMES:
            try:
                return import_from(folder, name)
            except ImportError:
                continue
    raise SceneError(
        "This Blender has no OpenVDB for Python: export Alembic or USD instead, or use a Blender "
        "from blender.org"
    )


def bundled_packages() -> str:
    """Return the folder of the packages that come with Blender, which its module does not add."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    python = Path(bpy.utils.system_resource("PYTHON") or "python")
    unix = python / "lib" / version / "site-packages"
    return str(unix if unix.is_dir() else python / "lib" / "site-packages")


def import_from(folder: str, name: str) -> ModuleType:
    """Import a module, from ``folder`` if that is given. Raises ImportError."""
    if not folder:
        return importlib.import_module(name)
    sys.path.append(folder)
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(folder)
