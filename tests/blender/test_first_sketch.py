# SPDX-License-Identifier: GPL-3.0-or-later
"""A first sketch in a real window, drawn with the mouse: New Sketch, strokes, Spin, splash."""

from pathlib import Path

import pytest

from tests.blender.test_window import pytestmark as needs_window
from tests.blender.test_window import (
    run_in_a_window,
    screen,  # noqa: F401 (a fixture)
)

pytestmark = [pytest.mark.slow, needs_window]
SCRIPT = Path(__file__).with_name("first_sketch_window.py")


def test_a_crown_out_of_two_strokes_and_speeds_as_they_were_drawn(screen):  # noqa: F811
    printed = run_in_a_window(screen, SCRIPT)
    assert "window: works" in printed and "Traceback" not in printed, printed


@pytest.mark.slow
def test_eight_flat_strokes_and_one_click(screen):  # noqa: F811
    printed = run_in_a_window(screen, SCRIPT.with_name("flat_sketch_window.py"))
    assert "window: works" in printed and "Traceback" not in printed, printed
