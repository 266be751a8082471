# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python packages that a splash needs and Blender does not contain."""

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
"""Names in the package index, by the names of the modules."""


def missing_packages() -> list[str]:
    """List the packages that are not installed, by their names in the package index."""
    return [
        package for module, package in PACKAGES.items() if importlib.util.find_spec(module) is None
    ]


def install_command() -> str:
    """Return the command that installs the missing packages for this Blender alone."""
    # Blender's own folder is often read-only; the user's scripts/modules folder is not.
    folder = bpy.utils.user_resource("SCRIPTS", path="modules")
    # pip installs a NumPy there too: it must be of the version that Blender was built with.
    packages = " ".join([*missing_packages(), f"numpy=={np.__version__}"])
    # PowerShell, which Windows opens by default, runs a quoted path only after an ampersand.
    call = "& " if sys.platform == "win32" else ""
    return f'{call}"{sys.executable}" -m pip install --target "{folder}" {packages}'
