# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of strokes in a real window: the file browser, dropped files, undo."""

import shutil
from pathlib import Path

import bpy
import pytest

from tests.blender.test_window import run_in_a_window, screen  # noqa: F401
from tests.core.stroke_files.making import apa, arches

SCRIPT = Path(__file__).with_name("files_window.py")

pytestmark = pytest.mark.skipif(
    not (bpy.app.binary_path and shutil.which("Xvfb")), reason="needs a Blender program and Xvfb"
)


def test_files_are_chosen_dropped_and_written_in_a_window(screen, tmp_path):  # noqa: F811
    (tmp_path / "painting.apa").write_bytes(apa(arches()))
    printed = run_in_a_window(screen, SCRIPT, str(tmp_path))
    assert "window: works" in printed and "Traceback" not in printed, printed
