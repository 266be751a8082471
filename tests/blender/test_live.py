# SPDX-License-Identifier: GPL-3.0-or-later
"""Live: the splash follows strokes and settings, in a window."""

from pathlib import Path

import pytest

from tests.blender.test_window import pytestmark, run_in_a_window, screen  # noqa: F401

SCRIPT = Path(__file__).with_name("live_window.py")


@pytest.mark.slow
def test_the_splash_follows_strokes_settings_and_undo(screen):  # noqa: F811
    printed = run_in_a_window(screen, SCRIPT)
    assert "live: works" in printed and "Traceback" not in printed, printed


@pytest.mark.slow
def test_following_leaves_nothing_in_memory(screen):  # noqa: F811
    printed = run_in_a_window(screen, SCRIPT, "soak")
    assert "live: works" in printed and "Traceback" not in printed, printed
