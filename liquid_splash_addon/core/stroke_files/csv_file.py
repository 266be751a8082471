# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes as CSV: a line for each point; the schema is in docs/stroke-files.md."""

from __future__ import annotations

import csv
import io
from array import array
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from ..sketch.drawing import Drawing
from .limits import MOST_LINES, StrokeFileError, check_counts
from .table import COLUMNS, Units, column_names, to_drawing, to_rows

ORDER = ("x", "y", "z", "t", "pressure", "stroke")
"""Columns of a file that does not name them."""

SEPARATORS = ",;\t"

UNIT_NAMES = ("length", "time", "axes")


def read_csv(data: bytes) -> tuple[list[Drawing], list[str]]:
    """Return the strokes of a file, metres (z up) and seconds, and warnings.

    Raises StrokeFileError where no line is a point. Lines that are none are left out with a
    warning; an empty line ends a stroke.
    """
    try:
        return read_lines(decoded(data))
    except (csv.Error, UnicodeError) as error:
        raise StrokeFileError(f"The file is no CSV, or damaged: {error}") from error


def decoded(data: bytes) -> Iterator[str]:
    """Yield the lines, without ever holding all of them as text."""
    is_wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    return io.TextIOWrapper(
        io.BytesIO(data), encoding="utf-16" if is_wide else "utf-8-sig", errors="replace"
    )


def read_lines(lines: Iterable[str]) -> tuple[list[Drawing], list[str]]:
    """Return the strokes of the lines of a file, and warnings."""
    source = iter(lines)
    named, first = head(source)
    separator = max(SEPARATORS, key=first.count)
    separator = separator if separator in first else " "
    names = [cell.strip().lower() for cell in next(csv.reader([first], delimiter=separator))]
    is_named = not any(is_number(cell, separator) for cell in names if cell)
    names = column_names(names if is_named else ORDER[: max(len(names), 3)])
    units = Units.named(named)
    numbers = [(names.index(name), name) for name in COLUMNS if name in names]
    stroke_at = names.index("stroke") if "stroke" in names else None
    values, owners = array("d"), array("l")
    strokes: dict[tuple[int, str], int] = {}
    block = bad = 0
    rest = source if is_named else chain_one(first, source)
    reader = csv.reader(rest, delimiter=separator, skipinitialspace=True)
    for line, cells in enumerate(reader):
        if line > MOST_LINES:
            raise StrokeFileError(f"The file has more than {MOST_LINES:,} lines: split it")
        if not any(cell.strip() for cell in cells):
            block += 1
            continue
        if cells[0].lstrip().startswith("#"):
            continue
        row = [number(cells, column, separator) for column, _ in numbers]
        if row[0] != row[0] or row[1] != row[1] or row[2] != row[2]:
            bad += 1
            continue
        known = cells[stroke_at] if stroke_at is not None and stroke_at < len(cells) else ""
        owners.append(strokes.setdefault((block, known.strip()), len(strokes)))
        values.extend(row)
        check_counts(len(strokes), len(owners))
    if not owners:
        raise StrokeFileError("No line of the file is a point: each needs at least x, y and z")
    warnings = [f"{bad:,} lines are no points: left out"] if bad else []
    table = np.frombuffer(values, dtype=np.float64).reshape(-1, len(numbers))
    return split(table, np.array(owners), [name for _, name in numbers], units), warnings


def head(source: Iterator[str]) -> tuple[dict[str, str], str]:
    """Return the units that comments name, and the first line that is no comment."""
    named: dict[str, str] = {}
    for line in source:
        if line.lstrip().startswith("#"):
            name, _, value = line.strip(" #\t\r\n,;").partition(":")
            if name.strip().lower() in UNIT_NAMES:
                named[name.strip().lower()] = value.strip()
        elif line.strip():
            return named, line
    raise StrokeFileError("The file has no lines with points")


def chain_one(first: str, rest: Iterator[str]) -> Iterator[str]:
    """Yield ``first``, then the rest."""
    yield first
    yield from rest


def number(cells: Sequence[str], column: int, separator: str) -> float:
    """Return the number in a cell; NaN where there is none."""
    if column >= len(cells):
        return np.nan
    text = cells[column]
    try:
        return float(text.replace(",", ".") if separator == ";" else text)
    except ValueError:
        return np.nan


def is_number(cell: str, separator: str) -> bool:
    """Whether a cell holds a number."""
    return number([cell], 0, separator) == number([cell], 0, separator)


def split(
    table: np.ndarray, owners: np.ndarray, names: Sequence[str], units: Units
) -> list[Drawing]:
    """Return the drawing of each stroke: of the rows ``(n, c)`` with its number in ``owners``."""
    order = np.argsort(owners, kind="stable")
    bounds = np.flatnonzero(np.diff(owners[order])) + 1
    return [to_drawing(table[part], names, units) for part in np.split(order, bounds)]


def to_csv(drawings: Sequence[Drawing]) -> bytes:
    """Return the bytes of a file with the drawings, metres, seconds, z up."""
    names, tables = to_rows(drawings)
    out = io.StringIO()
    out.write("# length: m\n# time: s\n# axes: z-up\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*names, "stroke"])
    for stroke, table in enumerate(tables):
        for row in table.tolist():
            writer.writerow([*("" if value != value else repr(value) for value in row), stroke])
    return out.getvalue().encode()
