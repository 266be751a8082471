# SPDX-License-Identifier: GPL-3.0-or-later
"""Where objects are: also those that the view layer does not evaluate.

Blender keeps ``matrix_world`` up to date only of what a view layer evaluates: not of objects that
are hidden, excluded, in another scene or in none. Those are evaluated here in a scene of their own,
that lives for the moment.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import bpy
import numpy as np
from mathutils import Matrix

from .objects import SceneError

Evaluated = Callable[[bpy.types.Object], bpy.types.Object]
"""Returns an object as it is evaluated."""

NAME = "Splash Places (temporary)"
MARK = "splash_places_only"
"""Custom property of a scene that is to be removed, should it ever be left behind."""


def world_matrix(item: bpy.types.Object) -> Matrix:
    """Return where an object is in the world, whether or not it is evaluated.

    Not while a panel is drawn, see :func:`shown_matrix`.
    """
    if is_evaluated(item):
        graph = bpy.context.evaluated_depsgraph_get()
        return item.evaluated_get(graph).matrix_world.copy()
    if is_simple(item):
        return shown_matrix(item)
    with evaluated([item]) as graph:
        return item.evaluated_get(graph).matrix_world.copy()


def bone_matrix(item: bpy.types.Object, name: str) -> Matrix | None:
    """Return where a bone of an object is in the world; None if it has no such bone."""
    if item.pose is None or name not in item.pose.bones:
        return None
    if is_evaluated(item):
        shown = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
        return shown.matrix_world @ shown.pose.bones[name].matrix
    with evaluated([item], name) as graph:
        shown = item.evaluated_get(graph)
        return shown.matrix_world @ shown.pose.bones[name].matrix


def shown_matrix(item: bpy.types.Object) -> Matrix:
    """Return ``matrix_world``; of hidden objects what can be known without evaluating them."""
    if is_evaluated(item) or not is_simple(item):
        return item.matrix_world.copy()
    if item.parent is None:
        return item.matrix_basis.copy()
    return shown_matrix(item.parent) @ item.matrix_parent_inverse @ item.matrix_basis


def is_evaluated(item: bpy.types.Object) -> bool:
    """Whether the view layer keeps an object's place up to date."""
    if item.is_evaluated:
        return True
    layer = bpy.context.view_layer
    return item.name in layer.objects and layer.objects[item.name] == item and item.visible_get()


def is_simple(item: bpy.types.Object) -> bool:
    """Whether an object's place follows from its own values and those of such parents alone."""
    if item.constraints or item.animation_data is not None or item.rigid_body is not None:
        return False
    if item.parent is None:
        return True
    return item.parent_type == "OBJECT" and (is_evaluated(item.parent) or is_simple(item.parent))


def rigid(matrix: Matrix) -> Matrix:
    """Return a matrix's place and turn, without its scale."""
    location, rotation, _ = matrix.decompose()
    return Matrix.LocRotScale(location, rotation, None)


def rigid_matrix(item: bpy.types.Object) -> Matrix:
    """Return the object's place and turn in the world, without its scale."""
    return rigid(world_matrix(item))


def inverted(matrix: Matrix, name: str) -> np.ndarray:
    """Return the inverse of an object's matrix, float64 ``(4, 4)``.

    Not ``Matrix.inverted``: it takes small objects for flat ones. Raises SceneError for one that is
    scaled to zero.
    """
    values = np.array(matrix, dtype=np.float64)
    linear = values[:3, :3]
    sizes = np.linalg.norm(linear, axis=0)
    if not np.isfinite(values).all() or not sizes.min() > 0:
        raise SceneError(f"'{name}' is scaled to zero: clear its scale first (Alt S)")
    if abs(np.linalg.det(linear / sizes)) < 1e-9:
        raise SceneError(f"'{name}' is sheared flat: clear its parent or its scale first")
    return np.linalg.inv(values)


def to_drawing_space(item: bpy.types.Object) -> np.ndarray:
    """Return the transform from the world to an object's place and turn, float64 ``(4, 4)``.

    Far from the origin ``Matrix.inverted``, in single precision, would be off by a unit.
    """
    return inverted(rigid_matrix(item), item.name)


def make_child(item: bpy.types.Object, parent: bpy.types.Object, place: np.ndarray) -> None:
    """Make an object a child and move it to a place in the world ``(4, 4)``.

    It has the parent's turn and scale undone, but not its location: of the difference of two places
    far from the origin little would be left. Raises SceneError where the parent is scaled to zero.
    """
    world = np.array(world_matrix(parent), dtype=np.float64)
    undone = inverted(Matrix(world.tolist()), parent.name)
    undone[:3, 3] = 0.0
    item.parent, item.parent_type = parent, "OBJECT"
    item.matrix_parent_inverse = Matrix(undone.tolist())
    move_to(item, place)


def move_to(item: bpy.types.Object, matrix: np.ndarray) -> None:
    """Move an object to a place in the world ``(4, 4)``, hidden or not, before its constraints."""
    parent = item.parent
    if parent is not None and item.parent_type != "OBJECT":
        item.matrix_world = Matrix(matrix.tolist())
        return
    above = np.eye(4)
    if parent is not None:
        above = np.array(world_matrix(parent)) @ np.array(item.matrix_parent_inverse)
    item.matrix_basis = Matrix((inverted(Matrix(above.tolist()), item.name) @ matrix).tolist())


def is_driven(item: bpy.types.Object) -> bool:
    """Whether something else than the artist's hand moves an object: keys, drivers, constraints."""
    animation = item.animation_data
    has_keys = animation is not None and (
        animation.action is not None or len(animation.drivers) > 0 or len(animation.nla_tracks) > 0
    )
    return has_keys or len(item.constraints) > 0


def is_child(item: bpy.types.Object, ancestor: bpy.types.Object) -> bool:
    """Whether ``ancestor`` is among the parents of ``item``."""
    while item.parent is not None:
        item = item.parent
        if item == ancestor:
            return True
    return False


@contextmanager
def evaluated(items: Sequence[bpy.types.Object], bone: str = "") -> Iterator[bpy.types.Depsgraph]:
    """Evaluate the places of objects, at the scene's frame, in a scene that holds nothing else.

    A constraint has Blender evaluate its target, wherever that is and whether or not it is hidden.
    """
    scene = temporary_scene()
    probe = bpy.data.objects.new(NAME, None)
    try:
        scene.collection.objects.link(probe)
        for item in items:
            constraint = probe.constraints.new("COPY_TRANSFORMS")
            constraint.target, constraint.subtarget = item, bone
        scene.view_layers[0].update()
        yield scene.view_layers[0].depsgraph
    finally:
        bpy.data.objects.remove(probe)
        bpy.data.scenes.remove(scene)


@contextmanager
def evaluated_copy(item: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """Evaluate an object that the view layer does not, its modifiers included; yield the result."""
    scene, copy = temporary_scene(), item.copy()
    try:
        copy.hide_viewport = False
        scene.collection.objects.link(copy)
        scene.view_layers[0].update()
        yield copy.evaluated_get(scene.view_layers[0].depsgraph)
    finally:
        bpy.data.objects.remove(copy)
        bpy.data.scenes.remove(scene)


@contextmanager
def at_frame(items: Sequence[bpy.types.Object], frame: int) -> Iterator[Evaluated]:
    """Have all that is read in this block be as it is at a frame, and the shown scene at its own.

    The context's scene is one that holds nothing but ``items``. The objects themselves keep the
    values of the shown scene: what is yielded returns them with those that are keyed.
    """
    scene, copies = temporary_scene(), {}
    probe = bpy.data.objects.new(NAME, None)
    try:
        scene.collection.objects.link(probe)
        for item in dict.fromkeys(items):
            probe.constraints.new("COPY_TRANSFORMS").target = item  # its place, if it is hidden
            if item.hide_viewport:
                copies[item] = item.copy()
                copies[item].hide_viewport = False
            scene.collection.objects.link(copies.get(item, item))
        layer = scene.view_layers[0]
        scene.frame_set(frame)  # with them in it, or their keys are not evaluated
        with bpy.context.temp_override(scene=scene, view_layer=layer):
            yield lambda item: copies.get(item, item).evaluated_get(layer.depsgraph)
    finally:
        for item in (probe, *copies.values()):
            bpy.data.objects.remove(item)
        bpy.data.scenes.remove(scene)


def data_now(item: bpy.types.Object) -> bpy.types.ID:
    """Return an object's data, not its modifiers' result, as keyed at the context's frame.

    Blender writes keyed values into the data itself, but for a scene that no window shows.
    """
    if item.is_evaluated or MARK not in bpy.context.scene:
        return item.data
    return item.data.evaluated_get(bpy.context.evaluated_depsgraph_get())


def temporary_scene() -> bpy.types.Scene:
    """Return a new scene at the frame of the current one."""
    real = bpy.context.scene
    scene = bpy.data.scenes.new(NAME)
    scene[MARK] = True
    for name in ("fps", "fps_base", "frame_map_old", "frame_map_new"):
        setattr(scene.render, name, getattr(real.render, name))
    scene.frame_set(real.frame_current, subframe=real.frame_subframe)
    return scene
