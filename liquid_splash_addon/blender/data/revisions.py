# SPDX-License-Identifier: GPL-3.0-or-later
"""Who has changed: properties report it here, and whoever keeps results up to date listens."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

Listener = Callable[[bpy.types.Object], None]

LIQUID, MOTION = "liquid", "motion"
"""What may change: what the mesh is made of, or only how fast it moves."""

_listeners: dict[str, list[Listener]] = {LIQUID: [], MOTION: []}


def changed(group: Any, _context: bpy.types.Context) -> None:
    """Tell whose liquid was changed; the ``update`` callback of properties."""
    tell(LIQUID, group.id_data)


def motion_changed(group: Any, _context: bpy.types.Context) -> None:
    """Tell whose motion was changed; the ``update`` callback of properties."""
    tell(MOTION, group.id_data)


def tell(what: str, item: bpy.types.Object) -> None:
    """Tell all listeners which object was changed."""
    for listener in _listeners[what]:
        listener(item)


def listen(listener: Listener, what: str = LIQUID) -> None:
    """Call ``listener`` with each object that is changed, by hand or by script."""
    _listeners[what].append(listener)


def ignore(listener: Listener, what: str = LIQUID) -> None:
    """Undo :func:`listen`."""
    _listeners[what].remove(listener)
