# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes of a Grease Pencil object as core's Drawings.

Drawings are in *drawing space*: the sketch object's place and turn, without its scale. So a
splash whose object stands where the sketch stands has the drawing's own coordinates, and a
scaled sketch is simply a larger one.

Time is the points' ``delta_time``: seconds since the stroke began, as Blender records it while
the artist draws. Pressure is kept only as the thickness that it gave the line: a point's pressure
is its radius divided by the largest radius in the sketch, so a thicker line is a faster one.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import bpy
import numpy as np
from mathutils import Matrix

from ...core.sketch.drawing import Drawing
from ...core.sketch.times import continuous_times

BEZIER, NURBS = 2, 3
"""Values of the ``curve_type`` attribute; 0 and 1 (Catmull-Rom, poly) run through their points."""

BEZIER_STEPS = 12
"""Straight pieces that a Bezier segment is read as; Blender's own default."""


def rigid_matrix(item: bpy.types.Object) -> Matrix:
    """Return the object's place and turn in the world, without its scale."""
    location, rotation, _ = item.matrix_world.decompose()
    return Matrix.LocRotScale(location, rotation, None)


def read_drawings(sketch: bpy.types.Object, only: str = "") -> tuple[list[Drawing], list[str]]:
    """Read the sketch's strokes at the current frame, in drawing space; return them and warnings.

    Layers without a drawing at this frame are left out, and so are hidden layers, with a warning.
    The sketch's modifiers are not applied: they would separate the points from their times.

    only : the name of the one layer to read, hidden or not; empty for all visible layers.
    """
    drawings, warnings, skipped = [], [], 0
    to_drawing = np.array(rigid_matrix(sketch).inverted(), dtype=np.float64)
    nurbs = 0
    for layer in sketch.data.layers:
        if not has_strokes(layer) or (only and layer.name != only):
            continue
        if is_hidden(layer) and not only:
            skipped += 1
            continue
        matrix = to_drawing @ layer_matrix(sketch, layer)
        for stroke in raw_strokes(layer.current_frame().drawing):
            nurbs += stroke.curve_type == NURBS
            drawings.append(to_drawing_space(stroke, matrix))
    if skipped:
        warnings.append(f"Left out {skipped} hidden layer(s): show them to include them")
    if nurbs:
        warnings.append(
            f"Read {nurbs} NURBS stroke(s) as straight lines between their control points: convert "
            "them to Bezier curves to keep their shape"
        )
    return drawings_with_pressure(drawings), warnings


def select_strokes(sketch: bpy.types.Object, only: str, numbers: Collection[int]) -> None:
    """Select strokes alone, by their places in what :func:`read_drawings` reads.

    only : as there
    """
    at = 0
    for layer in sketch.data.layers:
        frame = layer.current_frame()
        if frame is None:
            continue
        is_read = has_strokes(layer) and (layer.name == only if only else not is_hidden(layer))
        for stroke in frame.drawing.strokes:
            stroke.select = is_read and at in numbers
            at += is_read


def drawn_layers(sketch: bpy.types.Object) -> list[str]:
    """List the names of the visible layers that have strokes at the current frame."""
    return [
        layer.name for layer in sketch.data.layers if has_strokes(layer) and not is_hidden(layer)
    ]


def has_strokes(layer: Any) -> bool:
    """Whether a layer has strokes at the current frame."""
    frame = layer.current_frame()
    return frame is not None and len(frame.drawing.curve_offsets) > 1


def is_hidden(layer: Any) -> bool:
    """Whether a layer, or a group that holds it, is hidden."""
    return layer.hide or (layer.parent_group is not None and is_hidden(layer.parent_group))


def layer_matrix(sketch: bpy.types.Object, layer: Any) -> np.ndarray:
    """Return the transform of a layer's points to the world, float64 ``(4, 4)``."""
    local = np.array(layer.matrix_local, dtype=np.float64)
    parent = layer.parent
    if parent is None:
        return np.array(sketch.matrix_world, dtype=np.float64) @ local
    world = np.array(parent.matrix_world, dtype=np.float64)
    bone = parent.pose.bones.get(layer.parent_bone) if parent.pose else None
    if bone is not None:
        world = world @ np.array(bone.matrix, dtype=np.float64)
    return world @ np.array(layer.matrix_parent_inverse, dtype=np.float64) @ local


class RawStroke(NamedTuple):
    """One stroke's attributes as Blender keeps them; None where it keeps none."""

    points: np.ndarray  # (n, 3)
    times: np.ndarray | None  # (n,)
    radii: np.ndarray | None  # (n,)
    handles: tuple[np.ndarray, np.ndarray] | None  # left, right, (n, 3) each
    curve_type: int
    is_cyclic: bool


def raw_strokes(drawing: Any) -> Iterator[RawStroke]:
    """Yield the strokes of a Grease Pencil drawing."""
    points = read_attribute(drawing, "position")
    times = read_attribute(drawing, "delta_time")
    radii = read_attribute(drawing, "radius")
    handles = [read_attribute(drawing, f"handle_{side}") for side in ("left", "right")]
    cyclic = read_attribute(drawing, "cyclic")
    types = read_attribute(drawing, "curve_type")
    offsets = np.empty(len(drawing.curve_offsets), dtype=np.int32)
    drawing.curve_offsets.foreach_get("value", offsets)
    for number, (first, last) in enumerate(pairwise(offsets.tolist())):
        part = slice(first, last)
        left, right = (None if side is None else side[part] for side in handles)
        yield RawStroke(
            points[part] if points is not None else np.zeros((last - first, 3)),
            None if times is None else times[part],
            None if radii is None else radii[part],
            None if left is None or right is None else (left, right),
            0 if types is None else int(types[number]),
            cyclic is not None and bool(cyclic[number]),
        )


def read_attribute(drawing: Any, name: str) -> np.ndarray | None:
    """Return an attribute of a drawing as float64 ``(n,)`` or ``(n, 3)``; None if it is absent."""
    attribute = drawing.attributes.get(name)
    if attribute is None:
        return None
    is_vector = attribute.data_type == "FLOAT_VECTOR"
    shape = (len(attribute.data), 3) if is_vector else (len(attribute.data),)
    kind = np.float32 if attribute.data_type.startswith("FLOAT") else np.int32
    values = np.empty(shape, dtype=kind)
    attribute.data.foreach_get("vector" if is_vector else "value", values.ravel())
    return values.astype(np.float64)


def to_drawing_space(stroke: RawStroke, matrix: np.ndarray) -> Drawing:
    """Turn a stroke into a Drawing: closed, its Bezier curves sampled, moved by ``matrix``.

    Its pressures are still radii, see :func:`drawings_with_pressure`.
    """
    points, times, radii = stroke.points, stroke.times, stroke.radii
    if times is not None:
        times = continuous_times(times)
    if stroke.is_cyclic and len(points) > 2:
        points = np.append(points, points[:1], axis=0)
        times = None if times is None else np.append(times, closing_time(points, times))
        radii = None if radii is None else np.append(radii, radii[0])
    if stroke.curve_type == BEZIER and stroke.handles is not None and len(points) > 1:
        points = bezier_points(points, *stroke.handles)
        places = np.arange(len(points)) / BEZIER_STEPS
        times, radii = (
            None if v is None else np.interp(places, np.arange(len(v)), v) for v in (times, radii)
        )
    return Drawing(points @ matrix[:3, :3].T + matrix[:3, 3], times, radii)


def closing_time(closed: np.ndarray, times: np.ndarray) -> float:
    """Return when a closed stroke ``(n + 1, 3)`` is back at its start, if drawn at mean speed."""
    steps = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    drawn = steps[:-1].sum()
    share = steps[-1] / drawn if drawn > 0 else 0.0
    return float(times[-1] + share * (times[-1] - times[0]))


def bezier_points(points: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Sample ``((n - 1) * BEZIER_STEPS + 1, 3)`` points on the Bezier curve through ``(n, 3)``.

    left, right : handles before and after each point; on a closed curve only for the first n - 1.
    """
    left, right = (np.append(side, side[:1], axis=0)[: len(points)] for side in (left, right))
    t = (np.arange(BEZIER_STEPS) / BEZIER_STEPS)[None, :, None]
    corners = [part[:, None, :] for part in (points[:-1], right[:-1], left[1:], points[1:])]
    weights = [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3]
    curve = sum(weight * corner for weight, corner in zip(weights, corners, strict=True))
    return np.append(np.reshape(curve, (-1, 3)), points[-1:], axis=0)


def drawings_with_pressure(drawings: list[Drawing]) -> list[Drawing]:
    """Turn radii into pressures: the share of the sketch's largest radius.

    Where all points have one thickness there is nothing to tell pressure from: it is None then.
    """
    radii = [d.pressures for d in drawings if d.pressures is not None]
    together = np.concatenate(radii) if radii else np.zeros(1)
    largest = together.max()
    if not largest > 0 or np.ptp(together) < 1e-3 * largest:
        return [Drawing(d.points, d.times) for d in drawings]
    return [
        Drawing(d.points, d.times, None if d.pressures is None else d.pressures / largest)
        for d in drawings
    ]
