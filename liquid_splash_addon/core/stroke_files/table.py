# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of points that JSON and CSV hold: columns, units, axes (docs/stroke-files.md)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..sketch.drawing import Drawing
from .axes import AXES, to_blender
from .limits import StrokeFileError

COLUMNS = ("x", "y", "z", "t", "pressure", "speed")
"""Numbers that a point may have; the first three it must have."""

SYNONYMS = {"time": "t", "timestamp": "t"}

LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048, "km": 1000.0}
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


@dataclass(frozen=True)
class Units:
    """What the numbers of a table mean.

    Attributes
    ----------
    length : metres in a unit of length
    time : seconds in a unit of time
    axes : a name of AXES
    """

    length: float = 1.0
    time: float = 1.0
    axes: str = "z-up"

    @classmethod
    def named(cls, given: Mapping[str, Any]) -> Units:
        """Return the units that a file names. Raises StrokeFileError for unknown ones."""
        axes = str(given.get("axes", "z-up")).strip().lower()
        if axes not in AXES:
            raise StrokeFileError(f"axes must be one of {', '.join(AXES)}, not '{axes[:40]}'")
        return cls(
            unit_size("length", given.get("length", "m"), LENGTHS),
            unit_size("time", given.get("time", "s"), TIMES),
            axes,
        )


def unit_size(kind: str, given: Any, known: Mapping[str, float]) -> float:
    """Return the size of a unit that is given by its name or as a number."""
    name = str(given).strip().lower()
    if name in known:
        return known[name]
    try:
        size = float(name)
    except ValueError:
        size = 0.0
    if not 1e-12 <= size <= 1e12:
        raise StrokeFileError(
            f"The unit of {kind} must be one of {', '.join(known)}, or a positive number, "
            f"not '{name[:40]}'"
        )
    return size


def column_names(given: Sequence[Any]) -> list[str]:
    """Return columns by their names here. Raises StrokeFileError if x, y or z is missing."""
    names = [str(name).strip().lower() for name in given]
    names = [SYNONYMS.get(name, name) for name in names]
    for name in COLUMNS[:3]:
        if name not in names:
            raise StrokeFileError(
                f"There is no column '{name}': name the columns x, y, z, t, pressure, speed, stroke"
            )
    doubled = next((name for name in COLUMNS if names.count(name) > 1), None)
    if doubled:
        raise StrokeFileError(f"There are two columns '{doubled}': name one of them otherwise")
    return names


def to_drawing(rows: np.ndarray, names: Sequence[str], units: Units) -> Drawing:
    """Return the stroke of some rows ``(n, c)`` of a table; a column without numbers is none."""
    columns = {
        name: rows[:, names.index(name)]
        for name in COLUMNS
        if name in names and (name in COLUMNS[:3] or not np.isnan(rows[:, names.index(name)]).all())
    }
    points = np.stack([columns[name] for name in COLUMNS[:3]], axis=1) * units.length
    times, speeds = columns.get("t"), columns.get("speed")
    return Drawing(
        to_blender(points, units.axes),
        None if times is None else times * units.time,
        columns.get("pressure"),
        None if speeds is None else speeds * (units.length / units.time),
    )


def to_rows(drawings: Sequence[Drawing]) -> tuple[list[str], list[np.ndarray]]:
    """Return the names of the columns that some drawing has, and each one's rows ``(n, c)``.

    What a single drawing lacks is NaN. Metres, seconds, z up.
    """
    values = [(d.times, d.pressures, d.speeds) for d in drawings]
    kept = [n for n in range(3) if any(row[n] is not None for row in values)]
    names = [*COLUMNS[:3], *(COLUMNS[3 + n] for n in kept)]
    tables = []
    for drawing, row in zip(drawings, values, strict=True):
        lacking = np.full(len(drawing.points), np.nan)
        extra = [lacking if (column := row[n]) is None else column for n in kept]
        tables.append(np.column_stack([np.asarray(drawing.points, dtype=np.float64), *extra]))
    return names, tables
