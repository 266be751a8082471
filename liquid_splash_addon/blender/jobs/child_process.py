# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in a process of its own, by Blender's Python: Blender stays usable, and a crash is clean.

The program is compile_process.py. It says on lines of JSON how far it is.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import bpy

from ...core import compiled_code
from ..data.preferences import ADDON

PROGRAM = Path(__file__).with_name("compile_process.py")

ONE_THREAD = {
    name: "1"
    for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
}
"""Environment that leaves the other cores to Blender."""


class ChildProcess:
    """The process, and what it last said; derived classes say what to do with that.

    Attributes
    ----------
    last : the last line that was no JSON, as libraries and crashes write
    code : what it has returned; None as long as it runs
    """

    def __init__(self, order: Mapping[str, Any]) -> None:
        """Start it. Raises OSError where that is not possible.

        order : what it is to do other than compiling ahead, see compile_process.
        """
        self.last = "it said nothing"
        self.code: int | None = None
        self.is_stopped = False
        self._process = subprocess.Popen(
            command(),
            env={**os.environ, **ONE_THREAD},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
            **priority(is_job="module" in order),
        )
        about = {
            "path": sys.path,
            "package": ADDON,
            "folder": addon_folder(),
            "kept": str(compiled_code.folder() or ""),
            **order,
        }
        assert self._process.stdin is not None and self._process.stdout is not None
        # Its input stays open: its end would end the process.
        self._process.stdin.write(json.dumps(about) + "\n")
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
        self.is_stopped = True
        self._process.kill()
        self.wait()

    def hear(self, said: Mapping[str, Any]) -> None:
        """Take note of what a line says; called in another thread."""

    def end(self) -> None:
        """Take note of the end; called last, in another thread."""

    def _listen(self, lines: IO[str]) -> None:
        """Pass on what the process says, until it ends."""
        for line in lines:
            try:
                said = json.loads(line)
                said.keys()
            except (ValueError, AttributeError):  # a library's own message
                self.last = line.strip() or self.last
            else:
                self.hear(said)
        self.code = self._process.wait()
        for pipe in (self._process.stdin, lines):
            close(pipe)
        self.end()


def close(pipe: IO[str] | None) -> None:
    """Close a pipe whose other end may be gone."""
    try:
        if pipe is not None:
            pipe.close()
    except OSError:
        pass


def priority(is_job: bool) -> dict[str, int]:
    """Return what makes a process give way to others on Windows; elsewhere it does so itself.

    One that does a job does not: somebody waits for it.
    """
    if sys.platform != "win32":
        return {}
    if is_job:
        return {"creationflags": subprocess.CREATE_NO_WINDOW}
    return {"creationflags": subprocess.CREATE_NO_WINDOW | subprocess.BELOW_NORMAL_PRIORITY_CLASS}


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
