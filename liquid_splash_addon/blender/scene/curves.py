# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes of curve objects as core's Drawings: of the old type (Curve), of the new one and hair.

As Blender keeps both at last in the same attributes, both are read alike; only a curve of the old
type without its modifiers has to be put together from its splines.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import pairwise
from typing import Any

import bpy
import numpy as np

from ...core.sketch.drawing import Drawing
from ...core.sketch.splines import BEZIER, ENDPOINT, ENDPOINT_BEZIER, UNIFORM, Nurbs
from . import places
from .raw_strokes import BEZIER as BEZIER_TYPE
from .raw_strokes import NURBS as NURBS_TYPE
from .raw_strokes import (
    POLY,
    RawStroke,
    drawings_with_pressure,
    flowing,
    raw_strokes,
    to_drawing,
)


def read_drawings(
    item: bpy.types.Object,
    to_space: np.ndarray | None = None,
    evaluated: bpy.types.Object | None = None,
) -> tuple[list[Drawing], list[str]]:
    """Read an object's curves in drawing space; return them and warnings.

    to_space : world to drawing space, float64 ``(4, 4)``; by default the object's own.
    evaluated : the object with its modifiers applied, to be read instead. Where its curves have
    become a mesh, the curves themselves are read, with a warning.
    """
    if to_space is None:
        to_space = places.to_drawing_space(item)
    matrix = to_space @ np.array(places.world_matrix(item), dtype=np.float64)
    strokes, warnings = [], []
    geometry = None if evaluated is None else evaluated.evaluated_geometry()
    if geometry is not None and geometry.curves is not None:
        strokes = list(raw_strokes(geometry.curves, geometry.curves.curve_offset_data))
    elif geometry is not None and is_wire(geometry.mesh):
        strokes = list(wire_strokes(geometry.mesh))
    else:
        strokes = list(unmodified_strokes(item))
        if geometry is not None:
            warnings.append(
                f"'{item.name}' has no curves after its modifiers and bevel: read without them"
            )
    drawings = [flowing(stroke, to_drawing(stroke, matrix)) for stroke in strokes]
    return drawings_with_pressure(drawings), warnings


def is_wire(mesh: bpy.types.Mesh | None) -> bool:
    """Whether a mesh has edges only: what most modifiers make of a curve of the old type."""
    return mesh is not None and len(mesh.edges) > 0 and not len(mesh.polygons)


def wire_strokes(mesh: bpy.types.Mesh) -> Iterator[RawStroke]:
    """Yield the polylines of a mesh without faces that Blender made of curves.

    It puts the vertices of a curve one after the other. Radii are lost to it.
    """
    points = vectors(mesh.vertices, "co", 3)
    ends = np.empty((len(mesh.edges), 2), dtype=np.int32)
    mesh.edges.foreach_get("vertices", ends.ravel())
    ends.sort(axis=1)
    goes_on = np.zeros(len(points), dtype=bool)
    goes_on[ends[ends[:, 1] == ends[:, 0] + 1, 1]] = True
    closing = {(int(a), int(b)) for a, b in ends if b > a + 1}
    starts = np.flatnonzero(~goes_on)
    for first, last in pairwise([*starts.tolist(), len(points)]):
        yield RawStroke(points[first:last], is_cyclic=(first, last - 1) in closing)


def unmodified_strokes(item: bpy.types.Object) -> Iterator[RawStroke]:
    """Yield the curves that an object's data hold."""
    if item.type == "CURVES":
        yield from raw_strokes(item.data, item.data.curve_offset_data)
        return
    if item.mode == "EDIT":
        item.update_from_editmode()
    for spline in item.data.splines:
        if spline.type == "BEZIER":
            yield bezier_stroke(spline)
        elif spline.point_count_v == 1:  # else a surface
            yield point_stroke(spline)


def bezier_stroke(spline: Any) -> RawStroke:
    """Return a Bezier spline of an old curve."""
    points, left, right = (
        vectors(spline.bezier_points, name, 3) for name in ("co", "handle_left", "handle_right")
    )
    radii = vectors(spline.bezier_points, "radius", 1)[:, 0]
    return RawStroke(
        points, None, radii, None, (left, right), BEZIER_TYPE, bool(spline.use_cyclic_u)
    )


def point_stroke(spline: Any) -> RawStroke:
    """Return a poly or a NURBS spline of an old curve."""
    points = vectors(spline.points, "co", 4)
    radii = vectors(spline.points, "radius", 1)[:, 0]
    nurbs = None
    if spline.type == "NURBS":
        mode = {(False, False): UNIFORM, (True, False): ENDPOINT, (False, True): BEZIER,
                (True, True): ENDPOINT_BEZIER}  # fmt: skip
        knots = mode[bool(spline.use_endpoint_u), bool(spline.use_bezier_u)]
        nurbs = Nurbs(spline.order_u, knots, np.maximum(points[:, 3], 1e-6))
    kind = POLY if nurbs is None else NURBS_TYPE
    return RawStroke(points[:, :3], None, radii, None, None, kind, bool(spline.use_cyclic_u), nurbs)


def vectors(points: Any, name: str, width: int) -> np.ndarray:
    """Return a property of all points of a spline, float64 ``(n, width)``."""
    values = np.empty((len(points), width), dtype=np.float32)
    points.foreach_get(name, values.ravel())
    return values.astype(np.float64)


def select_strokes(item: bpy.types.Object, numbers: Collection[int]) -> None:
    """Select curves alone, in Edit Mode, by their places in what :func:`read_drawings` reads."""
    if item.type == "CURVES":
        name = ".selection"
        old = item.data.attributes.get(name)
        if old is not None:
            item.data.attributes.remove(old)
        item.data.selection_domain = "CURVE"
        made = item.data.attributes.new(name, "BOOLEAN", "CURVE")
        made.data.foreach_set("value", [n in numbers for n in range(len(item.data.curves))])
        item.data.update_tag()
        return
    for number, spline in enumerate(item.data.splines):
        for point in spline.bezier_points:
            point.select_control_point = number in numbers
            point.select_left_handle = point.select_right_handle = number in numbers
        for point in spline.points:
            point.select = number in numbers
