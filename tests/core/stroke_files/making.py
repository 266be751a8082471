# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes of stroke files, made here by the formats' descriptions; and where real ones may lie."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

SHARED = Path(__file__).resolve().parents[4] / "shared" / "strokes"
"""Real recordings, beside the checkout or two folders above it."""
if not SHARED.is_dir():
    SHARED = SHARED.parents[2] / "shared" / "strokes"


def apa(
    strokes: Sequence[Sequence[Sequence[float]]], times: Sequence[Sequence[int]] | None = None
) -> bytes:
    """Return an A-Painter file: points every 11 ms, unless ``times`` (ms) says otherwise."""
    parts = [
        b"\x08apainter",
        struct.pack("<HB", 1, 1),
        b"\x04line",
        struct.pack("<I", len(strokes)),
    ]
    for number, stroke in enumerate(strokes):
        parts.append(struct.pack("<B3ffI", 0, 1, 1, 1, 0.01, len(stroke)))
        stamps = times[number] if times is not None else [11 * n for n in range(len(stroke))]
        for point, stamp in zip(stroke, stamps, strict=True):
            parts.append(struct.pack("<3f4ffI", *point, 0, 0, 0, 1, 0.5, stamp))
    return b"".join(parts)


def sketch_bytes(
    strokes: Sequence[Sequence[Sequence[float]]],
    scale: float | None = None,
    step: int | None = 45,
    extension: bytes = b"",
) -> bytes:
    """Return ``data.sketch``: points every ``step`` ms, without times if that is None.

    extension : content of a stroke's extension of its own length
    """
    data = struct.pack("<IiII", 0xC576A5CD, 5, 0, 4) + b"more" + struct.pack("<i", len(strokes))
    stroke_mask = 0x1 | (0x2 if scale is not None else 0) | (0x10000 if extension else 0)
    for stroke in strokes:
        data += struct.pack("<i4ffII", 0, 1, 1, 1, 1, 0.1, stroke_mask, 0x1 if step is None else 3)
        data += struct.pack("<I", 7)
        data += b"" if scale is None else struct.pack("<f", scale)
        data += struct.pack("<I", len(extension)) + extension if extension else b""
        data += struct.pack("<i", len(stroke))
        for n, point in enumerate(stroke):
            data += struct.pack("<3f4ff", *point, 0, 0, 0, 1, 0.5)
            data += b"" if step is None else struct.pack("<I", step * n)
    return data


def tilt(
    sketch: bytes, entry: str = "data.sketch", compression: int = zipfile.ZIP_DEFLATED
) -> bytes:
    """Return a .tilt file around the bytes of a sketch."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", compression) as bundle:
        bundle.writestr("metadata.json", "{}")
        bundle.writestr(entry, sketch)
    return b"tilT" + bytes(12) + packed.getvalue()


def tracking(names: tuple[str, str] = ("triggerdown", "triggerup")) -> dict:
    """Return tracked motion: one controller at 1 m/s, 100 poses a second, two strokes of 0.2 s."""
    poses = [
        {"position": {"x": 0.01 * n, "y": 1.0, "z": -2.0}, "timestamp": 5000 + 10 * n}
        for n in range(100)
    ]
    detail = {"id": 1}
    events = [
        {"name": name, "detail": detail, "timestamp": 5000 + at}
        for at, name in zip((100, 300, 600, 800), names * 2, strict=True)
    ]
    head = [{"position": {"x": 0, "y": 2, "z": 0}, "timestamp": 5000}]
    return {"camera": {"poses": head}, "right": {"poses": poses, "events": events}}


def arches(count: int = 4) -> list[np.ndarray]:
    """Return strokes side by side, metres, y up."""
    angle = np.linspace(0, np.pi, 40)
    return [
        np.stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), np.full(40, 0.04 * n)], axis=1)
        for n in range(count)
    ]
