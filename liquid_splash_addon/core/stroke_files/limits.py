# SPDX-License-Identifier: GPL-3.0-or-later
"""How much a file of strokes may hold, and what is said of one that cannot be read.

A file is data from anywhere: what it claims to hold is compared with these limits, and with its
own size, before memory is asked for.
"""

from __future__ import annotations

FILE_BYTES = 128 * 2**20
"""The largest file that is opened."""

SKETCH_BYTES = 96 * 2**20
"""The most that is unpacked of a compressed file: beyond a million points of any .tilt."""

MOST_POINTS = 500_000
MOST_STROKES = 20_000

MOST_LINES = 4 * MOST_POINTS
"""Lines of a table, empty ones and remarks included."""

FARTHEST = 1e6
"""Metres from the origin beyond which a position is taken for a fault: no room is so large."""


class StrokeFileError(ValueError):
    """A file of which no strokes can be read; the message says why and what to do."""


def check_counts(strokes: int, points: int = 0) -> None:
    """Raise StrokeFileError for more strokes or points than are read."""
    for count, most, what in (
        (strokes, MOST_STROKES, "strokes"),
        (points, MOST_POINTS, "points"),
    ):
        if count > most:
            raise StrokeFileError(
                f"The file holds {count:,} {what} by its own account, at most {most:,} are read: "
                "split it, or see whether it is damaged"
            )
