# SPDX-License-Identifier: GPL-3.0-or-later
"""A simulation as a process of its own, which says on lines of JSON how far it is.

A job is a file, made by :func:`write_job`. The process is started either by
``python -m liquid_splash_addon.core.simulation.process JOB``, or by a program that can import the
package and calls :func:`work`. Out go lines of JSON: ``{"stage": "Frame 3 of 60", "share": 0.05,
"frames": 3}`` (``frames`` : how many are done), and last of all ``{"done": 61}`` or
``{"failed": "a sentence for the user"}``. Killed at any moment, it goes on where it was when it is
started again. It ends when its standard input does.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import traceback
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from .frames import UNREADABLE, frames_done, packed, unpacked, write_saying
from .run import run
from .settings import SimulationSettings
from .start import Start

Say = Callable[..., None]
"""Called with the values of one line."""


def write_job(path: Path | str, start: Start, settings: SimulationSettings, folder: str) -> None:
    """Write a job's file (.npz). folder : where its frames go. Raises OSError."""
    order = json.dumps({"settings": asdict(settings), "folder": folder})
    arrays = {"order": np.array(order), **start.to_arrays()}
    write_saying(Path(path), packed(arrays, 1))


def read_job(path: Path | str) -> tuple[Start, SimulationSettings, str]:
    """Return the start, the settings and the folder of a job's file; ValueError for a bad one."""
    try:
        arrays = unpacked(Path(path))
        order = json.loads(str(arrays["order"]))
        return Start.from_arrays(arrays), SimulationSettings(**order["settings"]), order["folder"]
    except (*UNREADABLE, TypeError) as error:
        raise ValueError(f"The simulation's job {path} cannot be read: simulate again") from error


def work(path: Path | str, say: Say) -> int:
    """Do the job of a file; return the exit code, 0 where all frames are done."""
    try:
        start, settings, folder = read_job(path)

        def report(stage: str, share: float) -> None:
            say(stage=stage, share=share, frames=frames_done(folder))

        say(done=run(start, settings, folder, report))
    except (ValueError, OSError) as error:
        say(failed=sentence(error))
        return 1
    except MemoryError:
        say(failed="There is not enough memory for this simulation: lower Resolution or Margin")
        return 1
    except Exception as error:
        traceback.print_exc()
        say(failed=f"The simulation failed ({type(error).__name__}: {error})")
        return 1
    return 0


def sentence(error: Exception) -> str:
    """Return what an error says, without the number that Python puts before it."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.strerror} ({error.filename})" if error.filename else error.strerror
    return str(error)


def say_on_stdout(**values: object) -> None:
    """Write a line of JSON."""
    sys.stdout.write(json.dumps(values) + "\n")
    sys.stdout.flush()


def end_with_parent() -> None:
    """Wait for the end of the input, which comes with the parent's end, however it comes."""
    sys.stdin.read()
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=end_with_parent, daemon=True).start()
    code = work(sys.argv[1], say_on_stdout)
    sys.stdout.flush()
    os._exit(code)  # not by sys.exit: the thread above waits for the input
