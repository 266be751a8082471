# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons in a real window: progress, Esc, undo. Where there is a Blender with a screen."""

import os
import shutil
import subprocess
from pathlib import Path

import bpy
import pytest

SCRIPT = Path(__file__).with_name("window_script.py")
STRESS = SCRIPT.with_name("stress_script.py")
SIZE = "800x600"

pytestmark = pytest.mark.skipif(
    not (bpy.app.binary_path and shutil.which("Xvfb")), reason="needs a Blender program and Xvfb"
)


@pytest.fixture
def screen():
    """Start a virtual screen and return its name."""
    read, write = os.pipe()
    options = ["-displayfd", str(write), "-screen", "0", SIZE + "x24", "-nolisten", "tcp"]
    server = subprocess.Popen(["Xvfb", *options], pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as answer:
        number = answer.readline().strip()
    yield f":{number}"
    server.terminate()
    server.wait()


def run_in_a_window(
    screen: str, script: Path, *words: str, timeout: float = 900.0, simulated: bool = True
) -> str:
    """Run a script in a Blender with a window; return what it printed.

    simulated : whether its events are the script's own; those of the window system are then ignored
    """
    command = [bpy.app.binary_path, "--factory-startup"]
    command += ["--enable-event-simulate"] if simulated else []
    command += ["--gpu-backend", "opengl", "--window-geometry", "0", "0", *SIZE.split("x")]
    environment = {**os.environ, "DISPLAY": screen, "LIBGL_ALWAYS_SOFTWARE": "1"}
    environment.pop("WAYLAND_DISPLAY", None)
    done = subprocess.run(
        [*command, "--python", script, "--", *words],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=timeout,
    )
    return done.stdout


def test_buttons_in_a_window(screen):
    printed = run_in_a_window(screen, SCRIPT)
    assert "window: works" in printed and "Traceback" not in printed, printed


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 3, 12])
def test_random_changes_with_work_in_flight(screen, seed):
    printed = run_in_a_window(screen, STRESS, "100", str(seed))
    assert "window: works" in printed and "Traceback" not in printed, printed


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_five_hundred_random_changes(screen, seed):
    printed = run_in_a_window(screen, STRESS, "500", str(seed), timeout=1800)
    assert "window: works" in printed and "Traceback" not in printed, printed
