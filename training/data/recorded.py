# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes that people recorded in VR: A-Painter (.apa) and Tilt Brush or Open Brush (.tilt)."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from liquid_splash_addon.core.sketch.drawing import Drawing

TILT_SENTINEL = 0xC576A5CD
TILT_UNIT = 0.1
"""Metres in a unit of Tilt Brush."""

PART_STROKES = 8
"""Strokes in a part of a recording that is tried by itself."""


def read_recording(path: Path) -> list[Drawing]:
    """Return the strokes of a recording, metres (z up) and seconds.

    What has no length (a click, a stamp) is left out. Raises ValueError for other files.
    """
    reader = READERS.get(path.suffix)
    if reader is None:
        raise ValueError(f"{path.name}: only {' and '.join(READERS)} are read")
    try:
        drawings = reader(path.read_bytes())
    except (struct.error, IndexError, KeyError, zipfile.BadZipFile) as error:
        raise ValueError(f"{path.name} is damaged, or no {path.suffix} file") from error
    return [d for d in drawings if len(d.points) > 1 and np.ptp(d.points, axis=0).max() > 0]


def recorded_sketches(directory: Path) -> dict[str, list[Drawing]]:
    """Return what to try of every recording in a directory, by name.

    The whole of it, and its first, middle and last PART_STROKES strokes: a sketch for one
    splash is small, a painting is many.
    """
    sketches = {}
    for path in sorted(p for p in directory.iterdir() if p.suffix in READERS):
        drawings = read_recording(path)
        sketches[path.stem] = drawings
        last = len(drawings) - PART_STROKES
        for start in sorted({0, last // 2, last}) if last > 0 else ():
            part = drawings[start : start + PART_STROKES]
            sketches[f"{path.stem} {start + 1}-{start + len(part)}"] = part
    if not sketches:
        raise ValueError(f"{directory} holds no recording ({', '.join(READERS)})")
    return sketches


def read_apa(data: bytes) -> list[Drawing]:
    """Return the strokes of an A-Painter file's bytes."""
    at = 1 + data[0] + 2
    if data[1 : 1 + data[0]] != b"apainter":
        raise KeyError("apainter")
    brushes = data[at]
    at += 1
    for _ in range(brushes):
        at += 1 + data[at]
    (count,) = struct.unpack_from("<I", data, at)
    at += 4
    layout = np.dtype(
        [("point", "<f4", 3), ("turn", "<f4", 4), ("pressure", "<f4"), ("time", "<u4")]
    )
    drawings = []
    for _ in range(count):
        (points,) = struct.unpack_from("<I", data, at + 17)
        table = np.frombuffer(_part(data, at + 21, points * layout.itemsize), dtype=layout)
        at += 21 + points * layout.itemsize
        x, y, z = table["point"].astype(float).T
        drawings.append(Drawing(np.stack([x, -z, y], axis=1), table["time"] / 1000.0))
    return drawings


def read_tilt(data: bytes) -> list[Drawing]:
    """Return the strokes of a Tilt Brush file's bytes."""
    # Behind a header of 16 bytes comes a zip, whose own offsets begin behind it too.
    with zipfile.ZipFile(io.BytesIO(data[16:])) as bundle:
        sketch = bundle.read("data.sketch")
    sentinel, _, _, extra = struct.unpack_from("<4I", sketch)
    if sentinel != TILT_SENTINEL:
        raise KeyError("sentinel")
    at = 16 + extra
    (count,) = struct.unpack_from("<i", sketch, at)
    at += 4
    drawings = []
    for _ in range(count):
        stroke_mask, point_mask = struct.unpack_from("<2I", sketch, at + 24)
        at += 32
        scale = 1.0
        for bit in range(32):
            if stroke_mask >> bit & 1:
                if bit == 1:
                    (scale,) = struct.unpack_from("<f", sketch, at)
                size = 4 if bit < 16 else 4 + struct.unpack_from("<I", sketch, at)[0]
                at += size
        (points,) = struct.unpack_from("<i", sketch, at)
        words = 7 + point_mask.bit_count()
        raw = _part(sketch, at + 4, points * words * 4)
        at += 4 + len(raw)
        places = np.frombuffer(raw, dtype="<f4").reshape(points, words)[:, :3] * TILT_UNIT
        times = None
        if point_mask & 2:
            column = 7 + (point_mask & 1)
            times = np.frombuffer(raw, dtype="<u4").reshape(points, words)[:, column]
            # Drawn in a scaled scene, the hand moved that much faster than the stroke shows.
            times = times / (1000.0 * scale)
        drawings.append(Drawing(places[:, [0, 2, 1]].astype(float), times))
    return drawings


def _part(data: bytes, start: int, size: int) -> bytes:
    """Return ``size`` bytes from ``start``; IndexError where the file ends before."""
    if size < 0 or start + size > len(data):
        raise IndexError(start)
    return data[start : start + size]


READERS: dict[str, Callable[[bytes], list[Drawing]]] = {".apa": read_apa, ".tilt": read_tilt}
"""How files are read, by the ends of their names."""
