# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes as JSON; the schema is in docs/stroke-files.md. Tracked controllers are JSON too."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..sketch.drawing import Drawing
from .controllers import is_tracking, read_tracking
from .limits import StrokeFileError, check_counts
from .table import COLUMNS, Units, column_names, to_drawing, to_rows

FORMAT = "strokes"
VERSION = 1

MEMORY = 320 * 2**20
"""Bytes that a parsed file may take."""

COSTS = {b"{": 232, b"[": 96, b",": 48, b":": 110, b'"': 32}
"""Bytes that Python keeps for each of these at most: an object, a list, a number, an entry, a
string. A file of nothing but ``{},`` grows by a factor of eighty."""


def read_json(data: bytes) -> tuple[list[Drawing], list[str]]:
    """Return the strokes of a file, metres (z up) and seconds, and warnings.

    Raises StrokeFileError for anything but the schema or tracked controllers. A stroke that is no
    table of numbers is left out with a warning.
    """
    content = parsed(data)
    if is_tracking(content):
        return read_tracking(content)
    if not isinstance(content, dict) or not isinstance(content.get("strokes"), list):
        raise StrokeFileError('The JSON file has no list "strokes": docs/stroke-files.md shows one')
    units = content.get("units", {})
    units = Units.named(units if isinstance(units, dict) else {})
    fields = content.get("fields")
    if fields is not None and not isinstance(fields, list):
        raise StrokeFileError('"fields" must be a list of names of columns')
    given = None if fields is None else column_names(fields)
    check_counts(len(content["strokes"]))
    drawings, unusable, points = [], 0, 0
    for stroke in content["strokes"]:
        drawing = read_stroke(stroke, given, units)
        if drawing is None:
            unusable += 1
            continue
        points += len(drawing.points)
        check_counts(0, points)
        drawings.append(drawing)
    if not unusable:
        return drawings, []
    lack = f"{unusable:,} of {len(content['strokes']):,} strokes are no tables of numbers"
    if not drawings:
        raise StrokeFileError(f"{lack}: a stroke is a list of points, a point a list of numbers")
    return drawings, [f"{lack}: left out"]


def read_stroke(stroke: Any, given: list[str] | None, units: Units) -> Drawing | None:
    """Return a stroke; None if it is no table of numbers with the columns given."""
    if not isinstance(stroke, list) or not stroke:
        return None
    try:
        rows = np.asarray(stroke, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        return None
    if rows.ndim != 2 or rows.shape[1] < 3:
        return None
    names = list(COLUMNS[: rows.shape[1]]) if given is None else given
    return to_drawing(rows, names, units) if rows.shape[1] >= len(names) else None


def parsed(data: bytes) -> Any:
    """Return the content of a JSON file, unless it would take too much memory."""
    worst = sum(data.count(sign) * cost for sign, cost in COSTS.items())
    if worst + len(data) * (2 if data.isascii() else 5) > MEMORY:
        raise StrokeFileError(
            f"Reading the JSON file would take more than {MEMORY // 2**20} MB: split it, or write "
            "the strokes as CSV"
        )
    try:
        return json.loads(data)
    except (ValueError, RecursionError) as error:
        place = f" at line {error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        raise StrokeFileError(f"The file is no JSON, or damaged{place}") from error


def to_json(drawings: Sequence[Drawing]) -> bytes:
    """Return the bytes of a file with the drawings, metres, seconds, z up."""
    names, tables = to_rows(drawings)
    strokes = [
        [[None if value != value else value for value in row] for row in table.tolist()]
        for table in tables
    ]
    head = {
        "format": FORMAT,
        "version": VERSION,
        "units": {"length": "m", "time": "s", "axes": "z-up"},
        "fields": names,
    }
    return json.dumps(head | {"strokes": strokes}, allow_nan=False).encode()
