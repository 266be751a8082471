# SPDX-License-Identifier: GPL-3.0-or-later
"""For all tests: an empty scene each, or no Blender at all where none is wanted."""

import importlib.util
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

BLENDER_MODULES = ("bpy", "bmesh", "mathutils", "gpu", "blf")

if os.environ.get("LIQUID_SPLASH_NO_BPY") == "1":
    # None makes an import fail, as where Blender is not installed.
    sys.modules.update(dict.fromkeys(BLENDER_MODULES))

HAS_BPY = importlib.util.find_spec("bpy") is not None


def left_out() -> list[str]:
    """Return what this way of testing leaves out: only what is about Blender needs it."""
    if not HAS_BPY:
        return ["blender"]
    return ["training", "core", *(path.name for path in Path(__file__).parent.glob("test_*.py"))]


collect_ignore = left_out()


def pytest_report_header() -> str:
    """Say at the top of the run which Blender it is."""
    if not HAS_BPY:
        return "Blender: none, tests/blender is left out"
    import bpy

    kind = "Python module" if bpy.app.module else "program"
    return f"Blender: {bpy.app.version_string}, {kind}"


@pytest.fixture(autouse=HAS_BPY)
def empty_scene() -> Iterator[None]:
    """Begin every test with a new, empty file, whatever the one before it left behind."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    yield
