# SPDX-License-Identifier: GPL-3.0-or-later
"""What a first splash would wait for is compiled ahead, by the stage that it waits for."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("torch")
pytest.importorskip("numba")

ROOT = Path(__file__).resolve().parents[2]

KEPT = """
import sys
from pathlib import Path
from liquid_splash_addon.core import compiled_code
compiled_code.keep_below(Path(sys.argv[1]))
from liquid_splash_addon.core import rehearsal
from liquid_splash_addon.core.progress import silent
"""

REHEARSED = """
own = rehearsal.Rehearsal()
own.draft(silent)
own.refined(silent)
"""

FIRST_SPLASHES = """
from dataclasses import replace
from liquid_splash_addon.core.compiling import event
from liquid_splash_addon.core.generator.loading import load_fastest
from liquid_splash_addon.core.sketch.drawing import strokes_from_drawings
from liquid_splash_addon.core.sketch.presets import example_sketch

class Listener(event.Listener):
    def on_start(self, found): pass
    def on_end(self, found):
        print("compiled", found.data["dispatcher"].py_func.__qualname__, found.data["args"])

generator = load_fastest(None, "CPU")
with event.install_listener("numba:compile", Listener()):
    for sketch, changed in (("crown", {}), ("letter_s", {}), ("wave", {"speed_gain": 0.6}),
                            ("jet", {"variation": 1.0, "seed": 3})):
        settings = replace(rehearsal.FULL, **changed)
        strokes, _ = strokes_from_drawings(example_sketch(sketch), settings)
        made = rehearsal.make_splash(strokes, settings, generator)
        rehearsal.Refiner(made.fields, strokes=made.strokes).refine(rehearsal.FRESH)
print("made")
"""


def run(script: str, folder: Path, threads: int) -> str:
    """Run a script in a Python of its own, with so many threads, and return what it says."""
    environment = {
        "PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT), "LIQUID_SPLASH_NO_BPY": "1",
        "OMP_NUM_THREADS": str(threads), "NUMBA_NUM_THREADS": str(threads),
    }  # fmt: skip
    command = [sys.executable, "-c", KEPT + script, str(folder)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@pytest.mark.slow
def test_a_first_splash_finds_all_that_it_needs_compiled(tmp_path) -> None:
    run(REHEARSED, tmp_path, threads=1)
    assert run(FIRST_SPLASHES, tmp_path, threads=2) == "made\n"
