# SPDX-License-Identifier: GPL-3.0-or-later
"""Where simulated frames are kept: in a folder beside the file, one for each splash or model."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from uuid import uuid4

import bpy

from ..data import index
from .objects import SceneError

BESIDE = "splash_cache"
"""Folder beside the file that holds those of its splashes."""

OWNER = "made_for.json"
"""File that says for which file the frames were made: copies of a file share its folders, until
they simulate anew."""


def unsaved_folder() -> Path:
    """Return where frames of a file are kept that has no place of its own yet."""
    return Path(tempfile.gettempdir()) / "liquid_splash"


def absolute(item: bpy.types.Object, folder: str) -> Path:
    """Return the place of a folder as ``item`` knows it; of a linked one, beside its library."""
    return Path(bpy.path.abspath(folder, library=item.library))


def is_temporary(folder: str) -> bool:
    """Whether frames are kept where the system may delete them."""
    return bool(folder) and Path(folder).parent == unsaved_folder()


def folder_of(item: bpy.types.Object) -> Path | None:
    """Return the folder of the frames of ``item``; None if it has none."""
    folder = item.splash_simulation.folder
    return absolute(item, folder) if folder else None


def folder_for(item: bpy.types.Object) -> str:
    """Return the folder in which ``item`` is to be simulated: its own, or a new one.

    That of a copy, of an object or of the file, is its original's.
    """
    folder = str(item.splash_simulation.folder)
    is_placed = is_temporary(folder) == (not bpy.data.filepath)
    if folder and is_placed and not is_shared(item) and is_of_this_file(absolute(item, folder)):
        return folder
    name = f"{bpy.path.clean_name(item.name)}_{uuid4().hex[:8]}"
    if bpy.data.filepath:
        return f"//{BESIDE}/{name}"
    return str(unsaved_folder() / name)


def is_shared(item: bpy.types.Object) -> bool:
    """Whether another object plays the frames of the same folder."""
    return any(other.splash_simulation.folder == item.splash_simulation.folder
               for other in simulated() if other != item)  # fmt: skip


def simulated() -> Iterator[bpy.types.Object]:
    """Yield the splashes and models that have frames."""
    for item in (*index.splashes(), *index.models()):
        if item.is_property_set("splash_simulation") and item.splash_simulation.folder:
            yield item


def is_of_this_file(folder: Path) -> bool:
    """Whether the frames in ``folder`` were made for the open file, or it cannot be known."""
    try:
        made_for = json.loads((folder / OWNER).read_text(encoding="utf-8"))["file"]
    except (OSError, ValueError, KeyError, TypeError):
        return True
    return bool(made_for == Path(bpy.data.filepath).name)


def prepare(folder: Path) -> None:
    """Make a folder for the open file. Raises SceneError where nothing can be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        content = json.dumps({"file": Path(bpy.data.filepath).name})
        (folder / OWNER).write_text(content, encoding="utf-8")
    except OSError as error:
        raise SceneError(
            f"Frames cannot be written to {folder} ({error.strerror}): save the file in a folder "
            "that can be written to"
        ) from error


def free_bytes(folder: Path) -> int:
    """Return what is free on the disk of a folder, which need not be there yet."""
    while not folder.is_dir() and folder != folder.parent:
        folder = folder.parent
    return shutil.disk_usage(folder).free


def used_bytes(folder: Path) -> int:
    """Return the size of all files in a folder; 0 if there is none."""
    try:
        with os.scandir(folder) as entries:
            return sum(entry.stat().st_size for entry in entries if entry.is_file())
    except OSError:
        return 0


def move(before: Path, after: Path) -> None:
    """Move frames to another folder of the open file. Raises OSError, SceneError."""
    prepare(after)
    shutil.rmtree(after)
    shutil.move(before, after)
    prepare(after)


def delete(folder: Path) -> None:
    """Delete frames, if they are there. Raises OSError."""
    if folder.is_dir():
        shutil.rmtree(folder)
