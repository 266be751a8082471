# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's objects: find one, check that it can be written, select it."""

from __future__ import annotations

from typing import NamedTuple

import bpy


class SceneError(ValueError):
    """Something in the scene stands in the way; the message says what to do."""


class Handle(NamedTuple):
    """An object to be found again later: its number outlives undo, a reference to it does not."""

    uid: int
    name: str

    @classmethod
    def of(cls, item: bpy.types.Object) -> Handle:
        """Return the handle of an object."""
        return cls(item.session_uid, item.name)

    def find(self) -> bpy.types.Object | None:
        """Find the object; None if it is gone. Names are looked up first: they are an index."""
        named = bpy.data.objects.get(self.name)
        if named is not None and named.session_uid == self.uid:
            return named
        return next((item for item in bpy.data.objects if item.session_uid == self.uid), None)


def check_writable(item: bpy.types.Object) -> None:
    """Raise SceneError if the mesh of ``item``, a splash or a model, cannot be replaced now."""
    name = item.name
    if item.type != "MESH":
        raise SceneError(f"'{name}' is no longer a mesh: make a new splash from its sketch")
    if not (item.is_editable and item.data.is_editable):
        raise SceneError(f"'{name}' is linked from another file: make it local first")
    if item.mode != "OBJECT":
        raise SceneError(f"'{name}' is being edited: switch to Object Mode first")
    if item.data.shape_keys is not None:
        raise SceneError(f"'{name}' has shape keys, which cannot follow: remove them first")


def select_only(context: bpy.types.Context, item: bpy.types.Object) -> None:
    """Select ``item`` alone and make it the active object, if the view layer shows it."""
    layer = context.view_layer
    if layer.objects.get(item.name) != item:
        return
    for other in context.selected_objects:
        other.select_set(False)
    layer.objects.active = item
    if item.visible_get():
        item.select_set(True)


def enter_object_mode(context: bpy.types.Context) -> None:
    """Switch to Object Mode, whatever mode the active object is in."""
    if context.active_object is not None and context.active_object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
