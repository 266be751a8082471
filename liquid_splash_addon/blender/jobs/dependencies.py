# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python packages that a splash needs and Blender does not contain."""

from __future__ import annotations

import sys

import bpy
import numpy as np

from ...core.packages import PACKAGES, broken_packages, is_installed
from ..scene.objects import SceneError


def missing_packages() -> list[str]:
    """List the packages that are not installed, by their names in the package index."""
    return [package for module, package in PACKAGES.items() if not is_installed(module)]


def check() -> None:
    """Raise SceneError if a package is missing without which nothing can be computed."""
    if missing := missing_packages():
        raise SceneError(
            f"Not installed: {', '.join(missing)}. The Splash tab in the sidebar shows how to "
            "install what is missing"
        )


def complaint() -> str:
    """Say in a sentence which packages have to be installed; nothing if none has."""
    missing, broken = missing_packages(), broken_packages()
    parts = [f"Not installed: {', '.join(missing)}."] if missing else []
    parts += [f"Broken: {', '.join(broken)}."] if broken else []
    return " ".join([*parts, "Run this in a terminal, then restart Blender:"]) if parts else ""


def install_command() -> str:
    """Return the command that installs the missing packages for this Blender alone."""
    # Blender's own folder is often read-only; the user's scripts/modules folder is not.
    folder = bpy.utils.user_resource("SCRIPTS", path="modules")
    broken = broken_packages()
    # pip installs a NumPy there too: it must be of the version that Blender was built with.
    packages = " ".join([*missing_packages(), *broken, f"numpy=={np.__version__}"])
    # Without it pip leaves alone what is there.
    replace = "--upgrade " if broken else ""
    # PowerShell, which Windows opens by default, runs a quoted path only after an ampersand.
    call = "& " if sys.platform == "win32" else ""
    return f'{call}"{sys.executable}" -m pip install --target "{folder}" {replace}{packages}'
