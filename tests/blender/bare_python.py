# SPDX-License-Identifier: GPL-3.0-or-later
"""A Python that has Blender's module and nothing that Blender does not have, and no network.

Or one that has other packages, and no Blender.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import venv
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path


def without_network() -> list[str]:
    """Return what runs a command without any network; nothing where the system has no such thing.

    Where it does, not even this machine's own addresses can be reached.
    """
    program = shutil.which("unshare")
    # Who is not root needs a namespace of users, which a changed root folder does not allow.
    for rights in ([], ["--map-root-user"]):
        command = [program or "unshare", "--net", *rights]
        if program and subprocess.run([*command, "true"], capture_output=True).returncode == 0:
            return command
    return []


def requirements_of(name: str, found: dict[str, metadata.Distribution]) -> None:
    """Collect an installed package and what it requires, by name."""
    try:
        package = metadata.distribution(name)
    except metadata.PackageNotFoundError:  # for another platform, or an extra
        return
    if found.setdefault(name.lower(), package) is not package:
        return
    for line in package.requires or []:
        if "extra ==" not in line:
            requirements_of(re.match(r"[\w.-]+", line)[0], found)


def bare_python(folder: Path, names: Sequence[str] = ("bpy",)) -> Path:
    """Make an environment in ``folder`` of some packages of this Python's and what they require."""
    venv.create(folder, with_pip=False, symlinks=True)
    (packages,) = folder.glob("lib/python*/site-packages")
    found: dict[str, metadata.Distribution] = {}
    for name in names:
        requirements_of(name, found)
    for package in found.values():
        for top in {Path(str(file)).parts[0] for file in package.files or []}:
            source = Path(str(package.locate_file(top)))
            if top != ".." and source.exists() and not (packages / top).exists():
                copy(source, packages / top)
    return folder / "bin" / "python"


def copy(source: Path, target: Path) -> None:
    """Copy a file or folder; as the same files on disk where that is possible."""
    if source.is_file():
        link(str(source), str(target))
    else:
        shutil.copytree(source, target, copy_function=link)


def link(source: str, target: str) -> str:
    """Link a file, or copy it where the disk is another one."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)
    return target
