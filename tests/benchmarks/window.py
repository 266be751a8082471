# SPDX-License-Identifier: GPL-3.0-or-later
"""Run a script in a Blender with a window, and take the numbers that it prints."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SIZE = "800x600"
"""Of the window."""

MARK = "numbers:"
"""Before a flat JSON object of them, on a line of its own."""


def in_second_window(script: str) -> dict[str, float]:
    """Return the numbers of a script beside this file; nothing where no Blender has a window.

    A first process compiles, and a second is measured.
    """
    return in_two_windows(script)[1]


def in_two_windows(script: str) -> tuple[dict[str, float], dict[str, float]]:
    """Return the numbers of two runs of a script, of which the first compiles everything.

    Both are given the folder for compiled code; nothing is in it at first.
    """
    blender = [os.environ["BLENDER"]] if "BLENDER" in os.environ else ["blender"]
    inside = [] if "BLENDER" in os.environ else [str(ROOT / "tests" / "blender_root.sh")]
    screen = ["xvfb-run", "-a", "-s", f"-screen 0 {SIZE}x24"]
    options = ["--factory-startup", "--enable-event-simulate", "--gpu-backend", "opengl"]
    options += ["--window-geometry", "0", "0", *SIZE.split("x")]
    options += ["--python", str(Path(__file__).with_name(script)), "--"]
    command = [*inside, "env", "LIBGL_ALWAYS_SOFTWARE=1", *screen, *blender, *options]
    found: list[dict[str, float]] = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(2):
            try:
                done = subprocess.run([*command, folder], cwd=ROOT, capture_output=True, text=True)
            except OSError as error:
                return no_window(str(error)), {}
            said = [line for line in done.stdout.splitlines() if line.startswith(MARK)]
            if not said:
                return no_window(done.stderr.strip().rpartition("\n")[2]), {}
            found.append(json.loads(said[0].removeprefix(MARK)))
    return found[0], found[1]


def no_window(reason: str) -> dict[str, float]:
    """Say why nothing was measured in a window, and return no numbers."""
    print(f"Not measured in a window: {reason}", file=sys.stderr)
    return {}
