# SPDX-License-Identifier: GPL-3.0-or-later
"""Who has changed: properties report it here, and whoever keeps results up to date listens."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

Listener = Callable[[bpy.types.Object], None]

_listeners: list[Listener] = []


def changed(group: Any, _context: bpy.types.Context) -> None:
    """Tell all listeners which object was changed; the ``update`` callback of its properties."""
    for listener in _listeners:
        listener(group.id_data)


def listen(listener: Listener) -> None:
    """Call ``listener`` with each object that is changed, by hand or by script."""
    _listeners.append(listener)


def ignore(listener: Listener) -> None:
    """Undo :func:`listen`."""
    _listeners.remove(listener)
