# SPDX-License-Identifier: GPL-3.0-or-later
"""The splashes of a model: its children, hidden while it stands for them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

from ..data.model import models, models_of, splashes_in
from . import mesh_object
from .grease_pencil import rigid_matrix
from .material import water_material
from .objects import SceneError

NAME = "Splash Model"


def new_model(context: bpy.types.Context, splashes: Sequence[bpy.types.Object]) -> bpy.types.Object:
    """Return a new model of ``splashes``, still without a mesh.

    It stands where the sketch of the first stands: mirrors and axis go through its origin.
    Raises SceneError where one of them cannot be a part.
    """
    check_free(splashes, None)
    model = bpy.data.objects.new(NAME, bpy.data.meshes.new(NAME))
    model.data.materials.append(water_material())
    sketch = splashes[0].splash.sketch
    mesh_object.home(context, splashes[0]).objects.link(model)
    model.matrix_world = rigid_matrix(splashes[0] if sketch is None else sketch)
    context.view_layer.update()
    model.splash_model.is_model = True
    add_parts(model, splashes)
    return model


def check_free(splashes: Sequence[bpy.types.Object], model: bpy.types.Object | None) -> None:
    """Raise SceneError for a splash that is a part of another model than ``model``."""
    for splash in splashes:
        if others := [other for other in models_of(splash) if other != model]:
            raise SceneError(
                f"'{splash.name}' is a part of '{others[0].name}': remove it there first"
            )


def add_parts(model: bpy.types.Object, splashes: Sequence[bpy.types.Object]) -> None:
    """Append those of ``splashes`` that are not in ``model`` yet, and have them go along with it.

    Raises SceneError where one of them is in another model.
    """
    check_free(splashes, model)
    group, known = model.splash_model, splashes_in(model)
    for splash in splashes:
        if splash not in known:
            follow(splash, model)
            part = group.parts.add()
            part.name, part.splash = splash.name, splash
            group.active = len(group.parts) - 1


def remove_part(model: bpy.types.Object, number: int) -> None:
    """Take a splash out of ``model``'s list and show it where it stood."""
    group = model.splash_model
    part = group.parts[number]
    splash = part.splash if part.is_there else None
    group.parts.remove(number)
    group.active = max(min(group.active, len(group.parts) - 1), 0)
    if splash is not None and splash.parent == model:
        place = mesh_object.world_matrix(splash)
        splash.parent = None
        splash.matrix_world = place
    settle()


def dissolve(model: bpy.types.Object) -> None:
    """Take all splashes out of ``model`` and delete it."""
    while model.splash_model.parts:
        remove_part(model, 0)
    bpy.data.meshes.remove(model.data)


def follow(splash: bpy.types.Object, model: bpy.types.Object) -> None:
    """Make ``splash`` a child of ``model``, where it stands, unless it has a parent already."""
    if splash.parent is None:
        place = mesh_object.world_matrix(splash)
        splash.parent = model
        splash.matrix_parent_inverse = mesh_object.world_matrix(model).inverted()
        splash.matrix_basis = place


def place_in(model: bpy.types.Object, splash: bpy.types.Object) -> np.ndarray:
    """Return the transform from the space of ``splash`` to that of ``model``, ``(4, 4)``."""
    if splash.parent == model and not splash.constraints:  # without the rounding of the way back
        return np.array(splash.matrix_parent_inverse @ splash.matrix_basis, dtype=np.float64)
    return np.array(
        mesh_object.world_matrix(model).inverted() @ mesh_object.world_matrix(splash),
        dtype=np.float64,
    )


def settle() -> None:
    """Hide the splashes that a model stands for; show those that have lost theirs."""
    covered = {
        splash
        for model in models()
        if model.splash_model.evaluated
        for splash in splashes_in(model)
    }
    for item in bpy.data.objects:
        if not item.splash.is_splash or not item.is_editable:
            continue
        # Known by a mark, so that a splash that the user shows or hides stays like that.
        if (item in covered) != item.splash.is_covered:
            item.splash.is_covered = item in covered
            item.hide_viewport = item.hide_render = item in covered


_count = 0


@bpy.app.handlers.persistent
def notice_deleted(_scene: Any, _graph: Any = None) -> None:
    """Show the splashes of a model that was deleted."""
    global _count
    if len(bpy.data.objects) != _count:
        _count = len(bpy.data.objects)
        settle()


@bpy.app.handlers.persistent
def refresh(_scene: Any, _graph: Any = None) -> None:
    """After undo and redo: what is hidden may be from another time than the models."""
    settle()


def handlers() -> list[tuple[Any, Any]]:
    """Return what is called when."""
    known = bpy.app.handlers
    return [
        (known.depsgraph_update_post, notice_deleted),
        (known.undo_post, refresh),
        (known.redo_post, refresh),
    ]


def register() -> None:
    """Follow what happens to models."""
    for called, handler in handlers():
        called.append(handler)


def unregister() -> None:
    """Stop following."""
    for called, handler in handlers():
        called.remove(handler)
