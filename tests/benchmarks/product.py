# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user waits for: the first splash after installing, of a new Blender, and one more."""

from __future__ import annotations

from tests.benchmarks.window import in_two_windows

FIRST = ("first_splash_seconds", "first_progress_still_seconds", "first_stall_ms")
LATER = ("new_blender_seconds", "again_seconds")


def measure() -> dict[str, float]:
    """Return this area's numbers; nothing where no Blender has a window."""
    first, later = in_two_windows("first_splash_window.py")
    named = [(name, first) for name in FIRST] + [(name, later) for name in LATER]
    return {f"product.{name}": numbers[name] for name, numbers in named if name in numbers}
