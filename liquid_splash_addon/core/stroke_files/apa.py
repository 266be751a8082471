# SPDX-License-Identifier: GPL-3.0-or-later
"""Paintings of A-Painter (.apa, version 1): metres, milliseconds, y up.

Little-endian. A byte's length and ``apainter``; version, uint16; a byte's number of brush names,
each with its length before it; number of strokes, uint32. A stroke: brush, byte; colour, 3 floats;
size, float; number of points, uint32; then its points of 36 bytes: position, 3 floats; turn,
4 floats; pressure, float; time in ms, uint32.
"""

from __future__ import annotations

import numpy as np

from ..sketch.drawing import Drawing
from .axes import to_blender
from .cursor import Cursor, TruncatedError
from .limits import StrokeFileError, check_counts

MAGIC = b"\x08apainter"
VERSION = 1

POINT = np.dtype([("place", "<f4", 3), ("turn", "<f4", 4), ("pressure", "<f4"), ("time", "<u4")])


def read_apa(data: bytes) -> tuple[list[Drawing], list[str]]:
    """Return the strokes as they are stored, metres (z up) and seconds, and warnings.

    Raises StrokeFileError for other bytes. What comes before a damaged place is kept.
    """
    if data[: len(MAGIC)] != MAGIC:
        raise StrokeFileError("This is no painting of A-Painter: its first bytes are others")
    cursor = Cursor(data, len(MAGIC))
    warnings = []
    if (version := cursor.number("H")) != VERSION:
        warnings.append(f"Version {version} of the .apa format is not known: read as {VERSION}")
    for _ in range(cursor.number("B")):
        cursor.text()
    count = cursor.number("I")
    check_counts(count)
    drawings: list[Drawing] = []
    points = 0
    try:
        for _ in range(count):
            drawings.append(read_stroke(cursor))
            points += len(drawings[-1].points)
            check_counts(0, points)
    except TruncatedError as error:
        if not drawings:
            raise
        warnings.append(f"{error}: {len(drawings):,} of {count:,} strokes were read")
    return drawings, warnings


def read_stroke(cursor: Cursor) -> Drawing:
    """Return the next stroke."""
    cursor.read("B3ff")
    table = np.frombuffer(cursor.take(cursor.number("I") * POINT.itemsize), dtype=POINT)
    points = to_blender(table["place"].astype(np.float64), "y-up")
    return Drawing(points, table["time"] / 1000.0, table["pressure"].astype(np.float64))
