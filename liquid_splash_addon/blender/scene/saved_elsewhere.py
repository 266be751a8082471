# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated frames of a file that is saved in another folder: it goes on playing them from there.

Blender makes paths that it knows of relative to the new place, but not text in nodes and groups.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import bpy

from . import frame_folder, motion_object
from .objects import Handle

_before: tuple[str, list[tuple[Handle, str]]] = ("", [])
"""The file's place before it is saved elsewhere, and the folders as they were stored."""


def set_folder(item: bpy.types.Object, folder: str) -> None:
    """Have a splash or model, and what plays its frames, find them in ``folder``."""
    item.splash_simulation.folder = folder
    motion_object.set_folder(item, folder)


@bpy.app.handlers.persistent
def before_saving(path: str, _unused: Any = None) -> None:
    """Make the folders relative to the place that the file is going to have."""
    global _before
    _before = bpy.data.filepath, []
    if not path or not bpy.data.filepath:
        return
    then, now = Path(path).parent, Path(bpy.data.filepath).parent
    if then == now:
        return
    for item in [*frame_folder.simulated()]:
        folder = item.splash_simulation.folder
        place = frame_folder.absolute(item, folder)
        if folder.startswith("//") and item.is_editable and place.is_dir():
            _before[1].append((Handle.of(item), folder))
            set_folder(item, relative(place, then))


@bpy.app.handlers.persistent
def after_saving(_path: str, _unused: Any = None) -> None:
    """If a copy was saved, and the open file is where it was, make them what they were."""
    place, folders = _before
    if place == bpy.data.filepath:
        for handle, folder in folders:
            item = handle.find()
            if item is not None:
                set_folder(item, folder)


def relative(place: Path, start: Path) -> str:
    """Return a place as a file in the folder ``start`` knows it."""
    try:
        return "//" + Path(os.path.relpath(place, start)).as_posix()
    except ValueError:  # another drive
        return str(place)


def register() -> None:
    """Listen to files being saved."""
    bpy.app.handlers.save_pre.append(before_saving)
    bpy.app.handlers.save_post.append(after_saving)


def unregister() -> None:
    """Stop listening."""
    bpy.app.handlers.save_pre.remove(before_saving)
    bpy.app.handlers.save_post.remove(after_saving)
