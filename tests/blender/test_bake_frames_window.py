# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking frames in a real window: the timeline stays, Esc keeps what is done."""

from pathlib import Path

import pytest

from tests.blender.test_window import pytestmark as needs_window
from tests.blender.test_window import (
    run_in_a_window,
    screen,  # noqa: F401 (a fixture)
)

pytestmark = [pytest.mark.slow, needs_window]
SCRIPT = Path(__file__).with_name("bake_frames_window.py")


def test_baking_in_a_window(screen):  # noqa: F811
    printed = run_in_a_window(screen, SCRIPT)
    assert "window: works" in printed and "Traceback" not in printed, printed
