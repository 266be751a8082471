# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulations from start to end: frames to a folder, resumed where they were stopped."""

from __future__ import annotations

from pathlib import Path

from ..progress import Report, silent
from .settings import SimulationSettings
from .start import Start


def run(
    start: Start, settings: SimulationSettings, folder: Path | str, report: Report = silent
) -> int:
    """Simulate frames 0 (the start) to ``settings.frames`` into ``folder``; return their number.

    Frames already there are kept if they were made from the same start and settings (see
    :func:`run_key`; more or fewer frames are no other settings), and the run goes on after the
    last of them, bit for bit as if it had never stopped; else they are deleted first.

    report : called before every frame with "Frame i of n" and the share done; may raise Cancelled,
    which leaves the frames that are done. Raises ValueError (no liquid, domain too large, an
    obstacle that cannot be used) and OSError (disk full, folder read-only), each with a sentence
    for the user.
    """
    raise NotImplementedError


def run_key(start: Start, settings: SimulationSettings) -> str:
    """Return what differs for another simulation: a hash of start, settings and solver version.

    The number of frames is not part of it.
    """
    raise NotImplementedError
