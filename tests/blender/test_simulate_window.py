# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulating in a real window: Blender stays usable, Esc keeps what is done."""

from pathlib import Path

import pytest

from tests.blender.test_window import pytestmark as needs_window
from tests.blender.test_window import (
    run_in_a_window,
    screen,  # noqa: F401 (a fixture)
)

pytestmark = [pytest.mark.slow, needs_window]
SCRIPT = Path(__file__).with_name("simulate_window.py")


def test_simulating_in_a_window(screen):  # noqa: F811
    printed = run_in_a_window(screen, SCRIPT)
    assert "window: works" in printed and "Traceback" not in printed, printed
