# SPDX-License-Identifier: GPL-3.0-or-later
"""Which task made the meshes of a splash or a model, and whether undo has left it at that.

What is evaluated is written after the undo step of the change that asked for it. On undo Blender
reads again what differs between two steps, and keeps the rest as it is now: it may restore an
object, which then says that an earlier task made its mesh, and keep the mesh of the later one, or
the other way round. So meshes are asked as well.
"""

from __future__ import annotations

from typing import Any

import bpy

from ..data import stored_liquid
from . import drop_points


def meshes_of(item: bpy.types.Object) -> list[bpy.types.Mesh]:
    """List the meshes that are written when ``item`` is evaluated: its own, and its drops'."""
    drops = drop_points.points_of(item)
    return [item.data] if drops is None else [item.data, drops.data]


def is_made_by(item: bpy.types.Object, record: Any, key: str) -> bool:
    """Whether the task with this key made what ``item`` shows.

    record : the object's property group with ``evaluated``
    """
    return record.evaluated == key and all(
        stored_liquid.is_made_by(mesh, key) for mesh in meshes_of(item)
    )


def is_made_of(splash: bpy.types.Object, digest: str) -> bool:
    """Whether a splash, and the liquid in its mesh, was made of strokes with this digest."""
    return splash.splash.made_of == digest and splash.data.splash_liquid.made_of in ("", digest)


def remember(item: bpy.types.Object, record: Any, key: str) -> None:
    """Record on an object and its meshes which task made them.

    record : the object's property group with ``evaluated`` and ``pending``
    """
    record.evaluated, record.pending = key, False
    for mesh in meshes_of(item):
        mesh.splash_liquid.evaluated = key
        mesh.update_tag()
    item.update_tag()
