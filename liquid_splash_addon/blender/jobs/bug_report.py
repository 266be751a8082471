# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bug report should say of the machine, and the last error in words."""

from __future__ import annotations

import platform
import sys
from pathlib import Path

import bpy
import numpy as np

from ...core import compiled_code
from ...core.packages import PACKAGES, is_installed, version_of
from ..data.preferences import measured, own_preferences
from ..data.version import addon_version
from .messages import last_sentence


def report(context: bpy.types.Context) -> str:
    """Return the report, a line for each fact. The user's own folder is not named in it."""
    facts = [
        ("Liquid Splash", addon_version()),
        ("Blender", bpy.app.version_string),
        ("System", f"{platform.system()} {platform.release()}, {platform.machine()}"),
        ("Python", platform.python_version()),
        ("NumPy", np.__version__),
        *((package, state_of(module)) for module, package in PACKAGES.items()),
        ("Devices", devices()),
        ("Formats", formats(context)),
        ("Compiled code", compiled_code.note() or f"complete: {compiled_code.is_complete()}"),
        ("Last error", last_sentence() or "none"),
    ]
    text = "\n".join(f"{name}: {value}" for name, value in facts)
    return text.replace(str(Path.home()), "~")


def state_of(module: str) -> str:
    """Return the version of a package, or that it is missing."""
    return version_of(module) or ("installed" if is_installed(module) else "missing")


def devices() -> str:
    """Return what torch can compute on, if it was imported already: that takes seconds."""
    torch = sys.modules.get("torch")
    if torch is None:
        return "torch was not used yet"
    names = [f"CPU, {torch.get_num_threads()} threads"]
    if torch.cuda.is_available():
        names.append(torch.cuda.get_device_name())
    if torch.backends.mps.is_available():
        names.append("Metal")
    return "; ".join(names)


def formats(context: bpy.types.Context) -> str:
    """Return which number format was measured to be the fastest, by device."""
    preferences = own_preferences(context)
    notes = measured(preferences) if preferences else {}
    return ", ".join(f"{device} {name}" for device, name in notes.items()) or "not measured"
