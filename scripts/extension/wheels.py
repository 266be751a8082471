# SPDX-License-Identifier: GPL-3.0-or-later
"""The wheels of a zip on this machine: from a folder, from earlier, or from the package index.

They are kept outside the checkout and are never changed: each has the hash that its list says.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from scripts.extension.lock import Unavailable, output_of, sources
from scripts.extension.targets import Target

LINE = re.compile(r"(?P<name>[\w.-]+)==(?P<version>\S+) --hash=sha256:(?P<digest>[0-9a-f]{64})"
                  r"  # (?P<file>\S+\.whl)")  # fmt: skip


class Wheel(NamedTuple):
    """One line of a list."""

    name: str
    version: str
    digest: str
    file: str

    @property
    def requirement(self) -> str:
        """Return the line that makes pip take this wheel and no other."""
        return f"{self.name}=={self.version} --hash=sha256:{self.digest}"


def kept_wheels() -> Path:
    """Return the folder where downloaded wheels are kept."""
    caches = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(caches) / "liquid-splash" / "wheels"


def listed(target: Target) -> list[Wheel]:
    """Return the wheels of a target. Raises Unavailable where its list was never made."""
    if not target.lock.is_file():
        raise Unavailable(
            f"Its wheels were never listed: put {target.torch} for it into a folder, then "
            "make lock WHEELS=folder"
        )
    lines = target.lock.read_text(encoding="utf-8").splitlines()
    return [read_line(line) for line in lines if not line.startswith("#")]


def read_line(line: str) -> Wheel:
    """Read a line of a list. Raises ValueError."""
    found = LINE.fullmatch(line)
    if found is None:
        raise ValueError(f"This line does not name a wheel with its hash: {line}")
    return Wheel(**found.groupdict())


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def is_there(wheel: Wheel, folder: Path | None) -> bool:
    """Return whether a folder holds exactly this wheel."""
    path = folder / wheel.file if folder else None
    return path is not None and path.is_file() and digest_of(path) == wheel.digest


def have(target: Target, folder: Path | None = None) -> list[Path]:
    """Return the files of a target's wheels, after downloading what is missing.

    folder : wheels that have precedence over the package index

    Raises Unavailable where one cannot be had or is not the one that is listed.
    """
    kept = kept_wheels()
    kept.mkdir(parents=True, exist_ok=True)
    wheels = listed(target)
    places = {
        wheel: place for wheel in wheels for place in (kept, folder) if is_there(wheel, place)
    }
    if missing := [wheel for wheel in wheels if wheel not in places]:
        download(target, missing, kept, folder)
    return [places.get(wheel, kept) / wheel.file for wheel in wheels]


def download(target: Target, wheels: list[Wheel], kept: Path, folder: Path | None) -> None:
    """Have pip download wheels, which checks their hashes. Raises Unavailable."""
    # Beside the others first: what is interrupted must not look like a wheel.
    with tempfile.TemporaryDirectory(dir=kept) as workspace:
        wanted = Path(workspace, "wanted.txt")
        wanted.write_text("".join(f"{wheel.requirement}\n" for wheel in wheels))
        command = [sys.executable, "-m", "pip", "download", "--require-hashes", "--quiet"]
        command += ["--no-cache-dir", "--dest", workspace, "--requirement", wanted]
        output_of([*command, *target.pip_options, *sources(folder)])
        for wheel in wheels:
            if not is_there(wheel, Path(workspace)):
                raise Unavailable(f"The package index gave another file than {wheel.file}")
            Path(workspace, wheel.file).replace(kept / wheel.file)


def place(path: Path, folder: Path) -> None:
    """Put a file into a folder; as the same file on disk where that is possible."""
    try:
        os.link(path, folder / path.name)
    except OSError:
        shutil.copy(path, folder)
