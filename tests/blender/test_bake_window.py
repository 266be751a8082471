# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking in a real window: Esc keeps what is done, nothing is written meanwhile, and it renders."""

from pathlib import Path

import pytest

from tests.blender.test_window import pytestmark as needs_window
from tests.blender.test_window import (
    run_in_a_window,
    screen,  # noqa: F401 (a fixture)
)

pytestmark = needs_window
SCRIPT = Path(__file__).with_name("bake_window.py")


@pytest.mark.slow
def test_baking_in_a_window(screen):  # noqa: F811
    printed = run_in_a_window(screen, SCRIPT, simulated=False)
    assert "window: works" in printed and "Traceback" not in printed, printed
