# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes that tools made into where their sources lie, with all that those have."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import bpy
import numpy as np

from ...core.sketch.drawing import tangents
from ...core.sketch.flow import Flow
from ...core.sketch.tools.tool import Derived
from .chosen_strokes import ChosenStroke, bounds_of
from .objects import SceneError
from .raw_strokes import BACKWARD, BEZIER, MULTIPLIER, POLY, PROFILE, SPEED
from .sketch import append_values
from .stroke_sheets import sheets_of

FIELDS = ("value", "vector", "color")
"""Names under which attributes of one type or another keep their values."""


class Column(NamedTuple):
    """An attribute: which of its names values have, and the values ``(n, width)``."""

    domain: str
    field: str
    values: np.ndarray


def write_derived(
    sketch: bpy.types.Object,
    chosen: Sequence[ChosenStroke],
    made: Sequence[Derived],
    keep: bool,
) -> None:
    """Put what a tool made of ``chosen`` strokes into the layers of their sources.

    keep : whether the chosen strokes stay; else what is made takes their places
    """
    sheets = {sheet.name: sheet for sheet in sheets_of(sketch)}
    for name in dict.fromkeys(stroke.layer for stroke in chosen):
        ours = [derived for derived in made if chosen[derived.source].layer == name]
        replaced = [] if keep else [stroke.number for stroke in chosen if stroke.layer == name]
        write_layer(sheets[name].drawing, sheets[name].matrix, chosen, ours, replaced)
    sketch.data.update_tag()
    sketch.update_tag()


def write_layer(
    drawing: Any,
    matrix: np.ndarray,
    chosen: Sequence[ChosenStroke],
    made: Sequence[Derived],
    replaced: Sequence[int],
) -> None:
    """Add strokes to a layer's drawing, then remove and reorder those that were replaced.

    matrix : of the layer's points to the world, ``(4, 4)``
    """
    bounds = bounds_of(drawing)
    before = read_columns(drawing)
    sources = [chosen[derived.source] for derived in made]
    if made:
        drawing.add_strokes([len(derived.places) for derived in made])
        for name, column in before.items():
            derive = curve_values if column.domain == "CURVE" else point_values
            add_values(drawing, name, column, derive(column, bounds, sources, made))
        write_shapes(drawing, int(bounds[-1]), matrix, made)
    if replaced:
        order = places_of(len(bounds) - 1, sources, replaced)
        # Blender takes the order as what is to come first, second and so on.
        drawing.reorder_strokes(new_indices=order)
        drawing.remove_strokes(indices=list(range(len(order) - len(replaced), len(order))))
    drawing.tag_positions_changed()


def places_of(count: int, sources: Sequence[ChosenStroke], replaced: Sequence[int]) -> list[int]:
    """Return the order in which new strokes stand where their sources stood, replaced ones last.

    count : strokes that were there; the new ones follow them
    """
    places = [*range(count), *(source.number for source in sources)]
    gone = set(replaced)
    kept = [number for number in range(len(places)) if number not in gone]
    return [*sorted(kept, key=lambda number: places[number]), *sorted(gone)]


def write_shapes(drawing: Any, before: int, matrix: np.ndarray, made: Sequence[Derived]) -> None:
    """Write places, times, radii and speeds of new strokes, behind the first ``before`` points."""
    inverse = np.linalg.inv(matrix)
    strokes = [derived.drawing for derived in made]
    points = np.concatenate([stroke.points for stroke in strokes])
    append_values(drawing, "position", before, points @ inverse[:3, :3].T + inverse[:3, 3])
    for name, attribute in (("delta_time", "times"), ("radius", "pressures")):
        columns = [getattr(stroke, attribute) for stroke in strokes]
        if all(column is not None for column in columns):
            append_values(drawing, name, before, np.concatenate(columns))
    if any(stroke.speeds is not None for stroke in strokes):
        # In the layer's own units: a stroke of a scaled object is shorter there.
        own = [
            np.full(len(stroke.points), np.nan)
            if stroke.speeds is None
            else stroke.speeds * np.linalg.norm(tangents(stroke.points) @ inverse[:3, :3].T, axis=1)
            for stroke in strokes
        ]
        append_values(drawing, SPEED, before, np.concatenate(own))


def write_flow(sketch: bpy.types.Object, chosen: Sequence[ChosenStroke], flow: Flow) -> None:
    """Have strokes remember what the artist says of their speed."""
    sheets = {sheet.name: sheet for sheet in sheets_of(sketch)}
    for name in dict.fromkeys(stroke.layer for stroke in chosen):
        drawing = sheets[name].drawing
        numbers = [stroke.number for stroke in chosen if stroke.layer == name]
        for attribute, kind, value in (
            (MULTIPLIER, "FLOAT", flow.multiplier),
            (BACKWARD, "BOOLEAN", flow.backward),
            (PROFILE, "FLOAT_VECTOR", flow.profile),
        ):
            known = drawing.attributes.get(attribute)
            if known is not None and (known.domain, known.data_type) != ("CURVE", kind):
                raise SceneError(
                    f"{of_layer(name)} an attribute '{attribute}' of another type: remove it"
                )
            if known is None:
                drawing.attributes.new(attribute, kind, "CURVE")
            column = read_columns(drawing)[attribute]
            column.values[numbers] = value
            drawing.attributes[attribute].data.foreach_set(column.field, column.values.ravel())
    sketch.data.update_tag()
    sketch.update_tag()


def of_layer(name: str) -> str:
    """Return how a sentence about a layer, or about curves without one, begins."""
    return f"Layer '{name}' has" if name else "These curves have"


def read_columns(drawing: Any) -> dict[str, Column]:
    """Read all attributes of a drawing that are numbers, by name."""
    found = {}
    for attribute in drawing.attributes:
        if not len(attribute.data):
            continue
        known = attribute.data[0].bl_rna.properties
        field = next((name for name in FIELDS if name in known), "value")
        kind = {"FLOAT": np.float32, "INT": np.int32, "BOOLEAN": bool}.get(known[field].type)
        if kind is None:  # text
            continue
        values = np.empty((len(attribute.data), width_of(known[field])), dtype=kind)
        attribute.data.foreach_get(field, values.ravel())
        found[attribute.name] = Column(attribute.domain, field, values)
    return found


def width_of(prop: Any) -> int:
    """Return how many numbers a property has: 16 of a matrix."""
    return int(prop.array_length) or 1


def curve_values(
    column: Column, _bounds: np.ndarray, sources: Sequence[ChosenStroke], _made: Sequence[Derived]
) -> np.ndarray:
    """Return the values of new strokes: those of their sources."""
    return column.values[[source.number for source in sources]]


def point_values(
    column: Column, bounds: np.ndarray, sources: Sequence[ChosenStroke], made: Sequence[Derived]
) -> np.ndarray:
    """Return the values of the points of new strokes: as on their sources where they come from.

    Numbers with a fraction are interpolated; of others the nearest point's are taken.
    """
    found = []
    for source, derived in zip(sources, made, strict=True):
        # A spline was read as a polyline of more points than it has.
        scale = (source.points - 1) / max(len(source.drawing.points) - 1, 1)
        places = np.clip(derived.places * scale, 0, source.points - 1) + bounds[source.number]
        low = np.floor(places).astype(int)
        high = np.minimum(low + 1, bounds[source.number] + source.points - 1)
        share = (places - low)[:, None]
        if column.values.dtype == np.float32:
            found.append((1 - share) * column.values[low] + share * column.values[high])
        else:
            found.append(column.values[np.where(share[:, 0] < 0.5, low, high)])
    return np.concatenate(found)


def add_values(drawing: Any, name: str, column: Column, values: np.ndarray) -> None:
    """Write an attribute anew: what it was, then the ``values`` of new strokes."""
    if name == "curve_type":  # splines were sampled
        values = np.where(values >= BEZIER, POLY, values)
    together = np.concatenate([column.values, values.astype(column.values.dtype)])
    drawing.attributes[name].data.foreach_set(column.field, together.ravel())
