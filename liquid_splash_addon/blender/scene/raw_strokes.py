# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes as Blender keeps them in attributes, turned into core's Drawings.

Grease Pencil drawings and curves keep theirs alike. Drawings are in *drawing space*: the sketch
object's place and turn, without its scale. So a splash whose object stands where the sketch stands
has the drawing's own coordinates, and a scaled sketch is simply a larger one.

Time is the points' ``delta_time``: seconds since the stroke began, as Blender records it while
the artist draws. Speed is the attribute ``speed``, units per second; of a vector its length.
Pressure is kept only as the thickness that it gave the line: a point's pressure is its radius
divided by the largest radius in the object, so a thicker line is a faster one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ...core.sketch.drawing import Drawing, tangents
from ...core.sketch.flow import Flow
from ...core.sketch.splines import (
    Nurbs,
    along_segments,
    bezier_points,
    catmull_rom_points,
    nurbs_values,
)
from ...core.sketch.strokes import arc_length
from ...core.sketch.times import continuous_times

CATMULL_ROM, POLY, BEZIER, NURBS = range(4)
"""Values of the ``curve_type`` attribute."""

SPEED = "speed"
"""Attribute with the speed of the hand, for the source of speed of that name."""

MULTIPLIER, BACKWARD, PROFILE = "splash_speed", "splash_backward", "splash_profile"
"""Attributes of whole strokes with what the artist says of their speed, see core.sketch.flow; where
they are zero, as those of strokes that were added later are, nothing is said."""

UNITLESS = 1e-3
"""Share of the largest radius by which radii differ at least where they say something."""


class RawStroke(NamedTuple):
    """One stroke's attributes as Blender keeps them; None where it keeps none."""

    points: np.ndarray  # (n, 3)
    times: np.ndarray | None = None  # (n,)
    radii: np.ndarray | None = None  # (n,)
    speeds: np.ndarray | None = None  # (n,)
    handles: tuple[np.ndarray, np.ndarray] | None = None  # left, right, (n, 3) each
    curve_type: int = POLY
    is_cyclic: bool = False
    nurbs: Nurbs | None = None
    flow: Flow | None = None


def raw_strokes(owner: Any, offsets: Any) -> Iterator[RawStroke]:
    """Yield the strokes of a Grease Pencil drawing or of curves.

    owner : has the attributes; offsets : Blender's list of where each stroke begins
    """
    found = {
        name: read_attribute(owner, name)
        for name in ("position", "delta_time", "radius", SPEED, "handle_left", "handle_right",
                     "cyclic", "curve_type", "nurbs_order", "knots_mode", "nurbs_weight",
                     MULTIPLIER, BACKWARD, PROFILE)
    }  # fmt: skip
    bounds = np.empty(len(offsets), dtype=np.int32)
    offsets.foreach_get("value", bounds)
    for number, (first, last) in enumerate(pairwise(bounds.tolist())):
        of_points = {
            name: None if values is None else values[first:last] for name, values in found.items()
        }
        kind = of_stroke(found, "curve_type", number, CATMULL_ROM)
        left, right = of_points["handle_left"], of_points["handle_right"]
        points = of_points["position"]
        yield RawStroke(
            points if points is not None else np.zeros((last - first, 3)),
            of_points["delta_time"],
            of_points["radius"],
            lengths(of_points[SPEED]),
            None if left is None or right is None else (left, right),
            kind,
            bool(of_stroke(found, "cyclic", number, 0)),
            nurbs_of(found, of_points["nurbs_weight"], number, last - first)
            if kind == NURBS
            else None,
            flow_of(found, number),
        )


def of_stroke(found: dict[str, np.ndarray | None], name: str, number: int, default: int) -> int:
    """Return the value of an attribute of whole strokes."""
    values = found[name]
    return default if values is None else int(values[number])


def flow_of(found: dict[str, np.ndarray | None], number: int) -> Flow | None:
    """Return what the artist says of a stroke's speed; None if nothing."""
    multiplier, profile = found[MULTIPLIER], found[PROFILE]
    said: dict[str, float] = {}
    if multiplier is not None and multiplier.ndim == 1 and multiplier[number] > 0:
        said["multiplier"] = multiplier[number]
    if profile is not None and profile.ndim == 2 and (profile[number] > 0).any():
        said |= zip(("start", "middle", "end"), profile[number], strict=True)
    is_backward = bool(of_stroke(found, BACKWARD, number, 0))
    if not (said or is_backward):
        return None
    # Elsewhere in Blender attributes can be given any value.
    limits = {item.name: item.metadata for item in fields(Flow)}
    kept = {
        name: float(np.clip(value, limits[name]["low"], limits[name]["high"]))
        for name, value in said.items()
        if np.isfinite(value)
    }
    return Flow(backward=is_backward, **kept)


def flowing(stroke: RawStroke, drawing: Drawing) -> Drawing:
    """Return what was read of a stroke as the artist wants it to flow."""
    return drawing if stroke.flow is None else stroke.flow.applied(drawing)


def nurbs_of(
    found: dict[str, np.ndarray | None], weights: np.ndarray | None, number: int, count: int
) -> Nurbs:
    """Return what makes a stroke of ``count`` points a NURBS curve; Blender's defaults else."""
    order = of_stroke(found, "nurbs_order", number, 4)
    knots = of_stroke(found, "knots_mode", number, 0)
    usable = weights is not None and bool((weights > 0).all())
    return Nurbs(order, knots, weights if usable and weights is not None else np.ones(count))


def lengths(values: np.ndarray | None) -> np.ndarray | None:
    """Return numbers ``(n,)`` as they are, vectors ``(n, 3)`` as their lengths.

    None where none are stored: those of strokes that were added later are zero, or NaN.
    """
    if values is None:
        return None
    sizes = np.abs(values) if values.ndim == 1 else np.linalg.norm(values, axis=1)
    return sizes if np.isfinite(sizes).all() and sizes.any() else None


def read_attribute(owner: Any, name: str) -> np.ndarray | None:
    """Return an attribute as float64 ``(n,)`` or ``(n, 3)``; None if it is absent."""
    attribute = owner.attributes.get(name)
    if attribute is None or attribute.data_type in ("STRING", "FLOAT_COLOR", "BYTE_COLOR"):
        return None
    kinds = {"FLOAT_VECTOR": (3, np.float32), "FLOAT": (1, np.float32), "BOOLEAN": (1, bool)}
    width, kind = kinds.get(attribute.data_type, (1, np.int32))
    shape = (len(attribute.data), 3) if width == 3 else (len(attribute.data),)
    values = np.empty(shape, dtype=kind)
    attribute.data.foreach_get("vector" if width == 3 else "value", values.ravel())
    return values.astype(np.float64)


def to_drawing(stroke: RawStroke, matrix: np.ndarray) -> Drawing:
    """Turn a stroke into a Drawing: closed, its splines sampled, moved by ``matrix`` ``(4, 4)``.

    Its pressures are still radii, see :func:`drawings_with_pressure`.
    """
    drawing = sampled(stroke)
    points, turn = drawing.points, matrix[:3, :3].T
    speeds = drawing.speeds
    if speeds is not None and len(points) > 1 and arc_length(points)[-1] > 0:
        # A scaled object's strokes are longer, and so is what is drawn of them in a second.
        speeds = speeds * np.linalg.norm(tangents(points) @ turn, axis=1)
    return replace(drawing, points=points @ turn + matrix[:3, 3], speeds=speeds)


def sampled(stroke: RawStroke) -> Drawing:
    """Return a stroke's polyline in its own space."""
    points, radii, speeds = stroke.points, stroke.radii, stroke.speeds
    times = None if stroke.times is None else continuous_times(stroke.times)
    closes = stroke.is_cyclic and len(points) > 2
    if stroke.nurbs is not None:
        return sampled_nurbs(points, (times, radii, speeds), stroke.nurbs, closes)
    if closes:
        points = np.append(points, points[:1], axis=0)
        times = None if times is None else np.append(times, closing_time(points, times))
        radii, speeds = (None if v is None else np.append(v, v[0]) for v in (radii, speeds))
    has_handles = stroke.curve_type == BEZIER and stroke.handles is not None
    if len(points) > 1 and (has_handles or stroke.curve_type == CATMULL_ROM):
        if has_handles and stroke.handles is not None:
            points = bezier_points(points, *stroke.handles)
        else:
            points = catmull_rom_points(points, closes)
        times, radii, speeds = (
            None if v is None else along_segments(v) for v in (times, radii, speeds)
        )
    return Drawing(points, times, radii, speeds)


def sampled_nurbs(
    points: np.ndarray, given: tuple[np.ndarray | None, ...], nurbs: Nurbs, is_cyclic: bool
) -> Drawing:
    """Return the polyline of a NURBS curve.

    given : times, radii and speeds, ``(n,)`` each. A closed curve has no times: they would have to
    go back to the first.
    """
    times, radii, speeds = (None if is_cyclic else given[0]), given[1], given[2]
    columns = [v for v in (times, radii, speeds) if v is not None]
    table = nurbs_values(np.column_stack([points, *columns]), nurbs, is_cyclic)
    rest = iter(table[:, 3:].T)
    times, radii, speeds = (None if v is None else next(rest) for v in (times, radii, speeds))
    return Drawing(table[:, :3], times, radii, speeds)


def closing_time(closed: np.ndarray, times: np.ndarray) -> float:
    """Return when a closed stroke ``(n + 1, 3)`` is back at its start, if drawn at mean speed."""
    steps = np.linalg.norm(np.diff(closed, axis=0), axis=1)
    drawn = steps[:-1].sum()
    share = steps[-1] / drawn if drawn > 0 else 0.0
    return float(times[-1] + share * (times[-1] - times[0]))


def drawings_with_pressure(drawings: list[Drawing]) -> list[Drawing]:
    """Turn radii into pressures: the share of the sketch's largest radius.

    Where all points have one thickness there is nothing to tell pressure from: it is None then.
    """
    radii = [d.pressures for d in drawings if d.pressures is not None]
    together = np.concatenate(radii) if radii else np.zeros(1)
    largest = together.max()
    if not largest > 0 or np.ptp(together) < UNITLESS * largest:
        return [replace(d, pressures=None) for d in drawings]
    return [
        replace(d, pressures=None if d.pressures is None else d.pressures / largest)
        for d in drawings
    ]
