# SPDX-License-Identifier: GPL-3.0-or-later
"""Compile ahead in a process of its own what the first splash would otherwise wait for.

It is started when the tab is first shown, unless that was done before. Blender stays usable: the
process gives way to all others. What is wanted meanwhile compiles what it needs itself.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import IO

import bpy

from ...core import compiled_code
from ..data.preferences import ADDON
from . import dependencies
from .job import redraw_sidebars

PROGRAM = Path(__file__).with_name("compile_process.py")

DELAY = 1.0
"""Seconds from the first look at the tab to the start: Blender has other things to do first."""

TICK = 0.2
"""Seconds between two looks at the process."""

ONE_THREAD = {
    name: "1"
    for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
}
"""Environment that leaves the other cores to Blender."""


class Ahead:
    """The process, and what it last said.

    Attributes
    ----------
    stage, share : what is being done; what is done, 0..1
    failed : why it ended too early; nothing as long as it did not
    note : a sentence for the user where compiled code could not be kept
    """

    def __init__(self) -> None:
        """Start it. Raises OSError where that is not possible."""
        self.stage, self.share, self.failed, self.note = "", 0.0, "", ""
        self._last = "it said nothing"
        self._is_stopped = False
        options: dict[str, int] = {}
        if sys.platform == "win32":
            options["creationflags"] = (
                subprocess.CREATE_NO_WINDOW | subprocess.BELOW_NORMAL_PRIORITY_CLASS
            )
        self._process = subprocess.Popen(
            command(),
            env={**os.environ, **ONE_THREAD},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
            **options,
        )
        order = {"path": sys.path, "package": ADDON, "folder": addon_folder()}
        assert self._process.stdin is not None and self._process.stdout is not None
        # Its input stays open: its end would end the process.
        self._process.stdin.write(json.dumps(order) + "\n")
        self._process.stdin.flush()
        self._thread = threading.Thread(
            target=self._listen, args=(self._process.stdout,), name="Liquid Splash", daemon=True
        )
        self._thread.start()

    @property
    def is_done(self) -> bool:
        """Whether it has ended."""
        return not self._thread.is_alive()

    def wait(self, seconds: float | None = None) -> None:
        """Wait for its end."""
        self._thread.join(seconds)

    def stop(self) -> None:
        """End it."""
        self._is_stopped = True
        self._process.kill()
        self.wait()

    def _listen(self, lines: IO[str]) -> None:
        """Take note of what the process says, until it ends."""
        for line in lines:
            try:
                said = json.loads(line)
                self.stage = said.get("stage", self.stage)
                self.share = said.get("share", self.share)
                self.failed = said.get("failed", self.failed)
                self.note = said.get("note", self.note)
            except (ValueError, AttributeError):  # a library's own message
                self._last = line.strip() or self._last
        code = self._process.wait()
        for pipe in (self._process.stdin, lines):
            close(pipe)
        if code == 0 and not self.note:
            finish()
        elif code != 0 and not self._is_stopped:
            self.failed = self.failed or self._last


def close(pipe: IO[str] | None) -> None:
    """Close a pipe whose other end may be gone."""
    try:
        if pipe is not None:
            pipe.close()
    except OSError:
        pass


def command() -> list[str]:
    """Return the command that runs the program with Blender's Python."""
    python = Path(sys.executable or "")
    if python.is_file() and python.stem.lower().startswith("python"):
        return [str(python), "-I", str(PROGRAM)]
    # A Blender whose Python is not there as a program of its own.
    return [bpy.app.binary_path, "--background", "--factory-startup", "--python", str(PROGRAM)]


def addon_folder() -> str:
    """Return the add-on's folder as Blender imported it: compiled code is bound to that."""
    return str(sys.modules[ADDON].__path__[0])


def finish() -> None:
    """Note that all was compiled, so that it is not done again."""
    folder = compiled_code.folder()
    if folder is not None:
        try:
            compiled_code.marker(folder).touch()
        except OSError as error:
            compiled_code.explain(f"Compiled code cannot be kept ({error.strerror})")


_ahead: Ahead | None = None
_is_asked = False


def ask() -> None:
    """Have it started soon, once, if there is something to do: for draw(), which must not."""
    global _is_asked
    if _is_asked or bpy.app.background:
        return
    _is_asked = True
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=DELAY, persistent=True)


def start() -> Ahead | None:
    """Start it now, if it does not run; return it. None where it cannot run."""
    global _ahead
    if dependencies.missing_packages():
        return None
    if _ahead is None or _ahead.is_done:
        try:
            _ahead = Ahead()
        except OSError:  # no splash needs it
            _ahead = None
    return _ahead


def running() -> Ahead | None:
    """Return the process; None if it does not run."""
    return _ahead if _ahead is not None and not _ahead.is_done else None


def note() -> str:
    """Return a sentence for the user if compiled code is not kept, else nothing."""
    if compiled_code.note():
        return compiled_code.note()
    if _ahead is None or not _ahead.is_done:
        return ""
    if _ahead.failed:
        return f"Preparing the first splash failed ({_ahead.failed}): it will take longer"
    return _ahead.note


def _tick() -> float | None:
    """Start the process, and show how far it is until it ends."""
    if _ahead is None:
        is_wanted = compiled_code.folder() is not None and not compiled_code.is_complete()
        if not is_wanted or start() is None:
            return None
    redraw_sidebars()
    return TICK if running() is not None else None


def register() -> None:
    """Let it be asked for."""
    global _is_asked
    _is_asked = False


def unregister() -> None:
    """End the process."""
    global _ahead
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if _ahead is not None:
        _ahead.stop()
    _ahead = None
