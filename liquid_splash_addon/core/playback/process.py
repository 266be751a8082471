# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulate and make files to play, in a process of its own: see core.simulation.process.

A job is a file of JSON, made by :func:`write_job`. Out go the lines of the simulation, with
``played``, the number of files that are ready, and ``warnings`` in the last one. Each file is made
beside the simulation, in a thread, as soon as its frame is there.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..simulation import process
from ..whole_file import write_whole
from .playback import Playback, Player

Say = Callable[..., None]

PAUSE = 0.1
"""Seconds between two looks for new frames."""


def write_job(path: Path, folder: Path, playback: Playback, simulation: Path | None) -> None:
    """Write a job's file.

    folder : of the frames; simulation : the file of the job that makes them, None if all that are
    wanted are there. Raises OSError.
    """
    job = {
        "folder": str(folder),
        "playback": playback.to_json(),
        "simulation": None if simulation is None else str(simulation),
    }
    write_whole(path, json.dumps(job).encode())


def work(path: Path | str, say: Say) -> int:
    """Do the job of a file; return the exit code, 0 where all frames are made and ready."""
    job = json.loads(Path(path).read_text(encoding="utf-8"))
    simulation = job["simulation"]
    obstacles = () if simulation is None else process.read_job(simulation)[0].obstacles
    playback = Playback.from_json(job["playback"])
    follower = Follower(Player(job["folder"], playback, obstacles), say)
    follower.start()
    code = 0
    try:
        if simulation is not None:
            code = process.work(simulation, follower.relay)
    finally:
        follower.finish()
    return follower.end(code)


class Follower:
    """Makes files to play in a thread, and passes on what the simulation says."""

    def __init__(self, player: Player, say: Say) -> None:
        """Take what makes the files."""
        self.player, self._say = player, say
        self._last: dict[str, Any] = {}
        self._error: Exception | None = None
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="Frames to play", daemon=True)

    def start(self) -> None:
        """Begin to look for frames."""
        self._thread.start()

    def finish(self) -> None:
        """Wait until all frames that are there are ready."""
        self._ending.set()
        self._thread.join()

    def relay(self, **values: Any) -> None:
        """Say what the simulation says; its last words are kept for :meth:`end`."""
        if "done" in values or "failed" in values:
            self._last = values
            return
        if self._error is not None:
            raise self._error
        self._say(**values, played=self.player.done)

    def end(self, code: int) -> int:
        """Say the last words and return the exit code."""
        failed = self._last.get("failed")
        if self._error is not None:
            failed = failed or str(self._error)
        if failed or code:
            self._say(failed=failed or "The simulation ended too early", played=self.player.done)
            return code or 1
        self._say(done=self.player.done, played=self.player.done, warnings=self.player.warnings)
        return 0

    def _run(self) -> None:
        try:
            while not self._ending.wait(PAUSE):
                self.player.catch_up()
            self.player.catch_up()
        except Exception as error:  # told to the simulation when it next speaks
            self._error = error
