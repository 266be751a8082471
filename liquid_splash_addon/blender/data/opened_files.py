# SPDX-License-Identifier: GPL-3.0-or-later
"""Bring what old files hold up to date: the open file, those opened later, those appended from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

Update = Callable[[Any, Any], None]


def moments() -> list[Any]:
    """Return the lists of handlers that Blender calls once data was read from a file."""
    lists = [bpy.app.handlers.load_post]
    if hasattr(bpy.app.handlers, "blend_import_post"):
        lists.append(bpy.app.handlers.blend_import_post)
    return lists


def listen(update: Update) -> None:
    """Call ``update``, a persistent handler, now and whenever a file has been read."""
    for moment in moments():
        moment.append(update)
    if hasattr(bpy.data, "objects"):  # not while Blender starts
        update(None, None)


def ignore(update: Update) -> None:
    """Undo :func:`listen`."""
    for moment in moments():
        moment.remove(update)
