# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons in a real window: progress, Esc, undo. Where there is a Blender with a screen."""

import os
import shutil
import subprocess
from pathlib import Path

import bpy
import pytest

SCRIPT = Path(__file__).with_name("window_script.py")
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


def test_buttons_in_a_window(screen):
    command = [bpy.app.binary_path, "--factory-startup", "--enable-event-simulate"]
    command += ["--gpu-backend", "opengl", "--window-geometry", "0", "0", *SIZE.split("x")]
    environment = {**os.environ, "DISPLAY": screen, "LIBGL_ALWAYS_SOFTWARE": "1"}
    environment.pop("WAYLAND_DISPLAY", None)
    done = subprocess.run(
        [*command, "--python", SCRIPT],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=400,
    )
    assert "window: works" in done.stdout and "Traceback" not in done.stdout, done.stdout
