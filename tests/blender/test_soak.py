# SPDX-License-Identifier: GPL-3.0-or-later
"""Three hundred splashes in one process leave memory flat and no data behind."""

import json
import os
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from tests.blender import soak

pytestmark = pytest.mark.once

ROOT = Path(__file__).resolve().parents[2]


def test_a_few_rounds_leave_nothing(tubes):
    came = soak.soak(3)
    assert came["orphans"] == 0 and came["more_data"] == 0


@pytest.mark.slow
@pytest.mark.skipif(not bpy.app.module, reason="the module's process is that of Python")
def test_three_hundred_generations_leave_memory_flat(tmp_path):
    out = tmp_path / "soak.json"
    command = [sys.executable, "-m", "tests.blender.soak", "--out", out]
    done = subprocess.run(command, cwd=ROOT, env=os.environ, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    came = json.loads(out.read_text())
    assert came["rounds"] == soak.ROUNDS and came["growth"] < soak.GROWTH
