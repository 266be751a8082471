# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python packages that a splash needs and Blender does not bring along."""

from __future__ import annotations

import importlib.util
import sys

import bpy
import numpy as np

PACKAGES = {
    "torch": "torch",
    "safetensors": "safetensors",
    "skimage": "scikit-image",
    "scipy": "scipy",
    "numba": "numba",
}
"""Name in the package index by name of the module."""


def missing_packages() -> list[str]:
    """Return the packages that are not installed, by their names in the package index."""
    return [
        package for module, package in PACKAGES.items() if importlib.util.find_spec(module) is None
    ]


def install_command() -> str:
    """Return the command that installs what is missing where this Blender, and only it, looks."""
    # Blender's own folder is often not writable; its user scripts' modules always are.
    folder = bpy.utils.user_resource("SCRIPTS", path="modules")
    # pip puts a NumPy of its own there: it must be the one that Blender was built with.
    packages = " ".join([*missing_packages(), f"numpy=={np.__version__}"])
    # PowerShell, which Windows opens by default, runs a quoted path only after an ampersand.
    call = "& " if sys.platform == "win32" else ""
    return f'{call}"{sys.executable}" -m pip install --target "{folder}" {packages}'
