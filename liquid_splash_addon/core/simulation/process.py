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

from collections.abc import Callable
from pathlib import Path

from .settings import SimulationSettings
from .start import Start

Say = Callable[..., None]
"""Called with the values of one line."""


def write_job(path: Path | str, start: Start, settings: SimulationSettings, folder: str) -> None:
    """Write a job's file (.npz). folder : where its frames go. Raises OSError."""
    raise NotImplementedError


def work(path: Path | str, say: Say) -> int:
    """Do the job of a file; return the exit code, 0 where all frames are done."""
    raise NotImplementedError
