# SPDX-License-Identifier: GPL-3.0-or-later
"""A splash stays on its sketch, whatever was done to either since it was made.

Each is known by a matrix: the sketch's *drawing space* to the world, and the liquid's drawing space
to the world, which is the splash's object and the space of its mesh together. How the strokes moved
is found from the strokes (see core's alignment), because objects can move without them: when a
transform is applied, or an origin set. The artist's own offset between splash and sketch is kept.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix

from ...core.grid import Grid
from ...core.sketch.alignment import is_similarity, similarity_between
from ...core.sketch.drawing import Drawing
from ...core.sketch.local_frame import Frame
from ...core.sketch.strokes import Stroke
from ..data.frame_text import frame_from_text
from ..data.properties import owner_of, plain
from . import mesh_space, places
from .objects import SceneError

SAME = 1e-5
"""Share of a splash's size by which two places may differ and still be the same."""

STEPS = 4e-7
"""Share of their distance from the origin by which they may: four to seven steps of single
precision. Less far than that no splash can be moved there."""


def strokes_moved(
    splash: bpy.types.Object,
    sketch: bpy.types.Object,
    strokes: Sequence[Stroke],
    drawings: Sequence[Drawing],
) -> tuple[np.ndarray, bool]:
    """Return how the strokes moved since the last run, and whether they are still the same ones.

    It goes from drawing space then to drawing space now, ``(4, 4)``; of strokes that were redrawn,
    as their object was resized.

    strokes : of the last run, local metres
    """
    record = splash.splash
    then, now = array(record.sketch_matrix), as_array(places.rigid_matrix(sketch))
    full = sketch_motion(splash, sketch)
    back = np.linalg.inv(now)
    resized = back @ full @ then
    guesses = [np.eye(4), resized, back @ then]
    frame = frame_from_text(record.frame) if record.frame else None
    side = plain(record.frame_real_size)
    if frame is not None and strokes:
        before = [frame.points_to_drawing(stroke.points.astype(np.float64)) for stroke in strokes]
        after = [np.asarray(drawing.points, dtype=np.float64) for drawing in drawings]
        found = similarity_between(before, after, guesses)
        if found is not None:
            return clean(found, corners_of(frame, side)), True
    corners = corners_of(frame, side)
    return (clean(resized, corners) if is_similarity(resized) else np.eye(4)), False


def sketch_motion(splash: bpy.types.Object, sketch: bpy.types.Object) -> np.ndarray:
    """Return how the sketch's object has moved in the world since the last run, ``(4, 4)``."""
    record = splash.splash
    if not record.is_property_set("sketch_world"):
        now = as_array(places.rigid_matrix(sketch))
        return np.asarray(now @ np.linalg.inv(array(record.sketch_matrix)))
    then, now = array(record.sketch_world), as_array(places.world_matrix(sketch))
    if abs(np.linalg.det(then[:3, :3])) < 1e-30:
        return np.eye(4)
    return np.asarray(now @ np.linalg.inv(then))


def settle(
    splash: bpy.types.Object, sketch: bpy.types.Object, moved: np.ndarray | None = None
) -> np.ndarray:
    """Move a splash as its strokes have moved; return the space its mesh is to be written in.

    moved : what :func:`strokes_moved` returned; by default they are as they were in drawing space
    """
    record, space = splash.splash, mesh_space.space_of(splash.data)
    target, is_still = wanted_place(splash, sketch, np.eye(4) if moved is None else moved)
    if not is_still and not places.is_driven(splash):
        places.move_to(splash, target @ np.linalg.inv(space))
        bpy.context.view_layer.update()
    frame = frame_from_text(record.frame) if record.frame else None
    corners = corners_of(frame, plain(record.frame_real_size))
    own = places.inverted(places.world_matrix(splash), splash.name) @ target
    return space if is_same(own, space, corners) else clean(own, corners)


def wanted_place(
    splash: bpy.types.Object, sketch: bpy.types.Object, moved: np.ndarray
) -> tuple[np.ndarray, bool]:
    """Return where a splash made now is to be: from drawing space to the world, ``(4, 4)``.

    And whether its object is there already: one that has come along, as a child, by a constraint or
    because both were moved, stays.

    moved : what :func:`strokes_moved` returned
    """
    record = splash.splash
    then, now = array(record.sketch_matrix), as_array(places.rigid_matrix(sketch))
    before, space = array(record.splash_matrix), mesh_space.space_of(splash.data)
    place = as_array(places.world_matrix(splash)) @ space
    frame = frame_from_text(record.frame) if record.frame else None
    corners = corners_of(frame, plain(record.frame_real_size))
    world = now @ moved @ np.linalg.inv(then)
    carried = sketch_motion(splash, sketch)
    change = world
    if is_same(place, world @ before, corners):
        change = np.eye(4)
    elif is_same(place, carried @ before, corners):
        change = clean(world @ np.linalg.inv(carried), corners)  # its strokes stayed behind
    elif is_same(place, before, corners):
        change = world
    elif is_same(world @ place, place, corners):
        change = np.eye(4)
    elif places.is_child(splash, sketch):
        change = clean(world @ np.linalg.inv(carried), corners)
    return change @ place @ np.linalg.inv(moved), np.array_equal(change, np.eye(4))


def carry_owned(splash: bpy.types.Object, before: np.ndarray, after: np.ndarray) -> None:
    """Move what belongs to a splash, its drops and frames, as the space of its mesh changes."""
    if np.array_equal(before, after):
        return
    change = Matrix((after @ np.linalg.inv(before)).tolist())
    for item in splash.children:
        if owner_of(item) == splash and item.is_editable:
            item.matrix_parent_inverse = change @ item.matrix_parent_inverse


def attach(splash: bpy.types.Object, sketch: bpy.types.Object) -> None:
    """Make a splash the child of its sketch, where it stands: it moves along, without a run.

    Does nothing for a sketch that is scaled to zero.
    """
    try:
        places.make_child(splash, sketch, as_array(places.world_matrix(splash)))
    except SceneError:
        return


def detach(splash: bpy.types.Object) -> None:
    """Make a splash no child any more, where it stands."""
    place = as_array(places.world_matrix(splash))
    splash.parent = None
    places.move_to(splash, place)


def remember(splash: bpy.types.Object, sketch: bpy.types.Object) -> None:
    """Record the places of splash and sketch for the next run."""
    for name, place in (
        ("sketch_matrix", places.rigid_matrix(sketch)),
        ("sketch_world", places.world_matrix(sketch)),
        ("splash_matrix", mesh_space.liquid_matrix(splash)),
    ):
        setattr(splash.splash, name, [value for row in place for value in row])


def corners_of(frame: Frame | None, side: float = 0.0) -> np.ndarray:
    """Return the corners ``(8, 3)`` of a splash's box in drawing space.

    side : of the box, metres at real size; 0 for that of the generator's
    """
    signs = np.stack(np.meshgrid(*3 * [[-1.0, 1.0]]), axis=-1).reshape(-1, 3)
    if frame is None:
        return signs
    return np.asarray(frame.points_to_drawing(signs * (side or Grid.local().size[0]) / 2))


def is_same(first: np.ndarray, second: np.ndarray, corners: np.ndarray) -> bool:
    """Whether two transforms ``(4, 4)`` take the corners ``(8, 3)`` to the same places."""
    one, other = (corners @ each[:3, :3].T + each[:3, 3] for each in (first, second))
    size = float(np.ptp(other, axis=0).max())
    # Blender's matrices are single precision: a product of a few is off by some of its steps.
    limit = SAME * size + STEPS * float(np.abs(other).max())
    return bool(np.abs(one - other).max() <= limit)


def clean(matrix: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return a transform, or exactly the identity where it is one but for rounding."""
    return np.eye(4) if is_same(matrix, np.eye(4), corners) else matrix


def as_array(matrix: Matrix) -> np.ndarray:
    """Return one of Blender's matrices, float64 ``(4, 4)``."""
    return np.array(matrix, dtype=np.float64)


def array(values: bpy.types.bpy_prop_array) -> np.ndarray:
    """Return 16 ``values``, row by row, as a matrix, float64 ``(4, 4)``."""
    return np.array(values, dtype=np.float64).reshape(4, 4)
