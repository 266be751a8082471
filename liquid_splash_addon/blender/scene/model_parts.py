# SPDX-License-Identifier: GPL-3.0-or-later
"""The splashes of a model: its children, hidden while the model shows them.

Nothing here computes: whoever changes the parts of a model has it evaluated afterwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

from ...core.settings import MotionSettings
from ..data import index
from ..data.model import models_of, splashes_in
from ..data.properties import assign_settings, to_settings
from . import mesh_object, mesh_space, places
from .material import water_material
from .objects import SceneError

NAME = "Splash Model"

ROUNDING = 1e-6
"""Share of its size by which a splash seems to have moved though it has not: vertices and places
are single precision."""


def new_model(context: bpy.types.Context, splashes: Sequence[bpy.types.Object]) -> bpy.types.Object:
    """Make a model of ``splashes``, still without a mesh.

    It stands where the first sketch stands: its mirror planes and axis go through its origin.
    Raises SceneError if a splash is in another model.
    """
    check_free(splashes, None)
    model = bpy.data.objects.new(NAME, bpy.data.meshes.new(NAME))
    model.data.materials.append(water_material())
    sketch = splashes[0].splash.sketch
    mesh_object.collection_for(context, splashes[0]).objects.link(model)
    model.matrix_world = places.rigid_matrix(splashes[0] if sketch is None else sketch)
    context.view_layer.update()
    model.splash_model.is_model = True
    motion = to_settings(splashes[0].splash_motion, MotionSettings)
    assign_settings(model.splash_motion, motion)
    add_parts(model, splashes)
    return model


def check_free(splashes: Sequence[bpy.types.Object], model: bpy.types.Object | None) -> None:
    """Raise SceneError if a splash is part of a model other than ``model``."""
    for splash in splashes:
        if others := [other for other in models_of(splash) if other != model]:
            raise SceneError(
                f"'{splash.name}' is part of '{others[0].name}': remove it there first"
            )


def add_parts(model: bpy.types.Object, splashes: Sequence[bpy.types.Object]) -> None:
    """Add those of ``splashes`` that are not in ``model`` yet, as its children.

    Raises SceneError if a splash is in another model; then none is added.
    """
    check_free(splashes, model)
    group, known = model.splash_model, splashes_in(model)
    for splash in splashes:
        if splash not in known:
            make_child(splash, model)
            part = group.parts.add()
            part.name, part.splash, splash.splash.owner = splash.name, splash, model
            group.active = len(group.parts) - 1


def remove_part(model: bpy.types.Object, number: int) -> None:
    """Take a splash out of the list of ``model`` and show it, where it stood."""
    group = model.splash_model
    part = group.parts[number]
    splash = part.splash if part.is_there else None
    group.parts.remove(number)
    group.active = max(min(group.active, len(group.parts) - 1), 0)
    if splash is not None and splash.splash.owner == model:
        splash.splash.owner = None
    if splash is not None and splash.parent == model:
        place = places.world_matrix(splash)
        splash.parent = None
        splash.matrix_world = place
    update_visibility()


def dissolve(model: bpy.types.Object) -> None:
    """Take all splashes out of ``model`` and delete the model."""
    while model.splash_model.parts:
        remove_part(model, 0)
    bpy.data.meshes.remove(model.data)


def make_child(splash: bpy.types.Object, model: bpy.types.Object) -> None:
    """Make ``splash`` a child of ``model``, at its place, unless the artist gave it a parent."""
    if splash.parent is None or splash.parent == splash.splash.sketch:
        places.make_child(splash, model, np.array(places.world_matrix(splash)))


def adopt_parts(model: bpy.types.Object) -> None:
    """Give a copied model its own splashes: copies of those of the original, as its children.

    Parts without an owner, in files from before owners were kept, become those of the first model.
    """
    for part in model.splash_model.parts:
        if not part.is_there or part.splash.splash.owner == model:
            continue
        if part.splash.splash.owner is None:
            part.splash.splash.owner = model
            continue
        original = part.splash
        copy = original.copy()
        copy.data = original.data.copy()
        for collection in original.users_collection:
            collection.objects.link(copy)
        if original.parent == original.splash.owner:
            copy.parent = model
            copy.matrix_parent_inverse = original.matrix_parent_inverse
        index.forget()  # Blender tells of the copy later
        copy.splash.owner, part.splash = model, copy
        part.name = copy.name


def place_in(model: bpy.types.Object, splash: bpy.types.Object) -> np.ndarray:
    """Return the transform from the space of ``splash`` to that of ``model``, ``(4, 4)``."""
    spaces = mesh_space.space_of(model.data), mesh_space.space_of(splash.data)
    is_plain = all(np.array_equal(space, np.eye(4)) for space in spaces)
    is_still = splash.parent == model and places.is_simple(splash)
    if is_plain and is_still:  # avoids the rounding of an inverse
        return np.array(splash.matrix_parent_inverse @ splash.matrix_basis, dtype=np.float64)
    place = np.array(mesh_space.liquid_matrix(splash), dtype=np.float64)
    found = mesh_space.liquid_inverse(model) @ place
    # What is moved by a rounding only would be sampled anew, and otherwise after an undo.
    moved = found - np.eye(4)
    moved[:3, 3] /= max(float(np.ptp(splash.bound_box, axis=0).max()), 1e-30)
    return np.eye(4) if np.abs(moved).max() < ROUNDING else found


def update_visibility() -> None:
    """Hide the splashes that a model shows; show those whose model is gone."""
    covered = {
        splash
        for model in index.models()
        if model.splash_model.evaluated
        for splash in splashes_in(model)
    }
    for item in index.splashes():
        # Changed only with the model, so that a splash the user shows or hides stays that way.
        if item.is_editable and (item in covered) != item.splash.is_covered:
            item.splash.is_covered = item in covered
            item.hide_viewport = item.hide_render = item in covered


_seen_revision = -1
"""Of the index, when its models were last looked at."""


@bpy.app.handlers.persistent
def notice_objects(_scene: Any, _graph: Any = None) -> None:
    """Show the splashes of a deleted model, and give copied models splashes of their own."""
    global _seen_revision
    if index.revision() == _seen_revision or bpy.app.is_job_running("RENDER"):
        return
    _seen_revision = index.revision()
    for model in index.models():
        if model.is_editable:
            adopt_parts(model)
    update_visibility()


@bpy.app.handlers.persistent
def after_undo(_scene: Any, _graph: Any = None) -> None:
    """Update what is hidden, which undo and redo may restore to another state than the models."""
    update_visibility()


def handlers() -> list[tuple[Any, Any]]:
    """Pair each list of handlers in Blender with the function to add to it."""
    known = bpy.app.handlers
    return [
        (known.depsgraph_update_post, notice_objects),
        (known.undo_post, after_undo),
        (known.redo_post, after_undo),
    ]


def register() -> None:
    """Start to watch what happens to models."""
    for known, handler in handlers():
        known.append(handler)


def unregister() -> None:
    """Stop watching."""
    for known, handler in handlers():
        known.remove(handler)
