# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own tool for extensions: it builds, checks and indexes."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path


def extension_tool() -> list[str | Path]:
    """Return the command that builds, validates and indexes extensions."""
    if blender := os.environ.get("BLENDER"):
        return [blender, "--command", "extension"]
    module = importlib.util.find_spec("bpy")
    if module is None or module.origin is None:
        raise SystemExit("Building needs BLENDER=/path/to/blender or the bpy module")
    scripts = Path(module.origin).parent.glob("*/scripts")
    return [sys.executable, next(scripts) / "addons_core/bl_pkg/cli/blender_ext.py"]


def run(*command: str | Path) -> None:
    """Run the tool, and end with its exit code if it fails: it has said why."""
    code = subprocess.run([*extension_tool(), *command]).returncode
    if code != 0:
        raise SystemExit(code)
