# SPDX-License-Identifier: GPL-3.0-or-later
"""Sketches of Tilt Brush and Open Brush (.tilt): a zip behind 16 bytes that begin ``tilT``.

Of the zip only ``data.sketch`` is read. It is little-endian: sentinel, version, reserved, size of a
further header (skipped), number of strokes. A stroke: brush, int32; colour, 4 floats; size, float;
masks of the extensions of stroke and points, uint32 each; a word of 4 bytes for each set bit of the
first mask (from bit 16 on: a length, and as many bytes); number of points, int32. A point:
position, 3 floats; turn, 4 floats; a word for each set bit of the second mask. A unit is 0.1 m;
axes are Unity's. Times are milliseconds.

Who draws in a scene that is shown at a scale moves the hand by so much more than the stroke shows.
Where a stroke stores that scale, its speed is multiplied by it: time is divided.
"""

from __future__ import annotations

import io
import zipfile
import zlib

import numpy as np

from ..sketch.drawing import Drawing
from .axes import to_blender
from .cursor import Cursor, TruncatedError
from .limits import SKETCH_BYTES, StrokeFileError, check_counts

SENTINEL = 0xC576A5CD
UNIT = 0.1
"""Metres in a unit of Tilt Brush."""

SCALE_BIT = 1
"""Bit of a stroke's mask that says that its scale is stored."""

PRESSURE, TIME = 1, 2
"""Bits of the points' mask."""

MOST_ENTRIES = 1000
"""Files in the zip, of which a sketch has three: a list of millions would fill the memory."""


def read_tilt(data: bytes) -> tuple[list[Drawing], list[str]]:
    """Return the strokes as they are stored, metres (z up) and seconds, and warnings.

    Raises StrokeFileError for other bytes. What comes before a damaged place is kept.
    """
    if data[:4] != b"tilT":
        raise StrokeFileError("This is no sketch of Tilt Brush or Open Brush: it begins otherwise")
    cursor = Cursor(unpacked(data))
    sentinel, _, _, extra = cursor.read("IiII")
    if sentinel != SENTINEL:
        raise StrokeFileError("The file is damaged: its data.sketch begins with other bytes")
    cursor.take(extra)
    count = cursor.number("i")
    check_counts(count)
    drawings: list[Drawing] = []
    warnings, scales, points = [], [], 0
    try:
        for _ in range(count):
            drawing, scale = read_stroke(cursor)
            drawings.append(drawing)
            scales.append(scale)
            points += len(drawing.points)
            check_counts(0, points)
    except TruncatedError as error:
        if not drawings:
            raise
        warnings.append(f"{error}: {len(drawings):,} of {count:,} strokes were read")
    return drawings, warnings + scale_warnings(np.array(scales))


def scale_warnings(scales: np.ndarray) -> list[str]:
    """Return what to say of the scales ``(n,)``: NaN where none is stored, 0 where it is none."""
    warnings = []
    if len(scales) and np.isnan(scales).any():
        warnings.append(
            f"{np.isnan(scales).sum():,} of {len(scales):,} strokes do not say at which zoom they "
            "were drawn: their speed is that at the size stored"
        )
    if unusable := int((scales == 0).sum()):
        warnings.append(f"{unusable:,} strokes store a zoom that is no positive number: ignored")
    return warnings


def unpacked(data: bytes) -> bytes:
    """Return the bytes of ``data.sketch``, unless they are too many."""
    if data.count(b"PK\x01\x02") > MOST_ENTRIES:
        raise StrokeFileError(
            f"The .tilt file lists more than {MOST_ENTRIES} files: it is no sketch"
        )
    try:
        # The zip's offsets count from its own beginning; zipfile finds out how much lies before.
        with zipfile.ZipFile(io.BytesIO(data)) as bundle:
            entry = bundle.getinfo("data.sketch")
            if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise StrokeFileError("The .tilt file is packed in a way that no sketch is")
            with bundle.open(entry) as packed:
                sketch = packed.read(SKETCH_BYTES + 1)
    except KeyError as error:
        raise StrokeFileError("The .tilt file holds no data.sketch: it is no sketch") from error
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError, RuntimeError,
            UnicodeError, OverflowError, ValueError) as error:  # fmt: skip
        if isinstance(error, StrokeFileError):
            raise
        raise StrokeFileError("The .tilt file is damaged, or was not written to its end") from error
    if len(sketch) > SKETCH_BYTES:
        raise StrokeFileError(
            f"The .tilt file unpacks to more than {SKETCH_BYTES // 2**20} MB: split the sketch"
        )
    return sketch


def read_stroke(cursor: Cursor) -> tuple[Drawing, float]:
    """Return the next stroke and its scale: NaN if none is stored, 0 if that is none."""
    cursor.read("i4ff")
    stroke_mask, point_mask = cursor.read("II")
    scale = float("nan")
    for bit in range(32):
        if stroke_mask >> bit & 1:
            if bit == SCALE_BIT:
                scale = cursor.number("f")
                scale = scale if 0 < scale < float("inf") else 0.0
            else:
                cursor.take(4 if bit < 16 else cursor.number("I"))
    words = 7 + point_mask.bit_count()
    raw = cursor.take(cursor.number("i") * words * 4)
    floats = np.frombuffer(raw, dtype="<f4").reshape(-1, words)
    points = to_blender(floats[:, :3].astype(np.float64) * UNIT, "y-up-left-handed")
    times = pressures = None
    if point_mask & PRESSURE:
        pressures = floats[:, 7].astype(np.float64)
    if point_mask & TIME:
        whole = np.frombuffer(raw, dtype="<u4").reshape(-1, words)
        factor = scale if scale > 0 else 1.0
        times = whole[:, 7 + (point_mask & PRESSURE)] / (1000.0 * factor)
    return Drawing(points, times, pressures), scale
