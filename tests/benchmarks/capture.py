# SPDX-License-Identifier: GPL-3.0-or-later
"""How soon the splash follows the pen, in a window."""

from __future__ import annotations

from tests.benchmarks.window import in_second_window


def measure() -> dict[str, float]:
    """Return this area's numbers; none where no Blender has a window."""
    return in_second_window("live_window.py")
