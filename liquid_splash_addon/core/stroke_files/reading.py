# SPDX-License-Identifier: GPL-3.0-or-later
"""Open a file of strokes, or write one; the end of its name says of which kind it is."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from ..sketch.drawing import Drawing
from .apa import read_apa
from .csv_file import read_csv, to_csv
from .json_file import read_json, to_json
from .limits import FILE_BYTES, StrokeFileError
from .recording import Recording, checked
from .tilt import read_tilt


class Kind(NamedTuple):
    """A kind of file.

    Attributes
    ----------
    read : returns the strokes of a file's bytes as they are stored, and warnings
    by_hand : whether what it holds was certainly drawn by hand, at the size of a body
    write : returns the bytes of a file; None if such files are only read
    """

    read: Callable[[bytes], tuple[list[Drawing], list[str]]]
    by_hand: bool
    write: Callable[[Sequence[Drawing]], bytes] | None = None


KINDS = {
    ".tilt": Kind(read_tilt, by_hand=True),
    ".apa": Kind(read_apa, by_hand=True),
    ".json": Kind(read_json, by_hand=False, write=to_json),
    ".csv": Kind(read_csv, by_hand=False, write=to_csv),
}
"""Kinds of files, by the ends of their names."""


class StrokeFileWarning(UserWarning):
    """Something in a file of strokes is not as it should be; the message says what was done."""


def read_strokes(path: str | Path) -> list[Drawing]:
    """Return the strokes of a .tilt, .apa, JSON or CSV file: metres (z up), seconds.

    Issues a StrokeFileWarning for each thing that was wrong with them. Raises StrokeFileError,
    with the file's name, where no stroke can be read, OSError where there is no such file.
    """
    recording = read_recording(path)
    for message in recording.warnings:
        warnings.warn(f"{Path(path).name}: {message}", StrokeFileWarning, stacklevel=2)
    return recording.drawings


def read_recording(path: str | Path) -> Recording:
    """Return the strokes of a file with what there is to say of them; raises as read_strokes."""
    path = Path(path)
    kind = kind_of(path)
    size = path.stat().st_size
    try:
        if size > FILE_BYTES:
            raise StrokeFileError(
                f"The file has {size / 2**20:,.0f} MB, at most {FILE_BYTES // 2**20} MB are read: "
                "split it"
            )
        return read_bytes(path.read_bytes(), kind)
    except StrokeFileError as error:
        raise StrokeFileError(f"{path.name}: {error}") from error


def read_bytes(data: bytes, kind: Kind) -> Recording:
    """Return the strokes of a file's bytes."""
    drawings, found = kind.read(data)
    return checked(drawings, found, kind.by_hand)


def write_strokes(path: str | Path, drawings: Sequence[Drawing]) -> None:
    """Write strokes, metres (z up) and seconds, as JSON or CSV. Raises StrokeFileError, OSError."""
    Path(path).write_bytes(file_bytes(Path(path), drawings))


def file_bytes(path: Path, drawings: Sequence[Drawing]) -> bytes:
    """Return what to write into a file of the kind that its name says. Raises StrokeFileError."""
    kind = KINDS.get(path.suffix.lower())
    if kind is None or kind.write is None:
        raise StrokeFileError(f"{path.name}: strokes are written as .json or .csv only")
    if not drawings:
        raise StrokeFileError("There are no strokes to write: draw at least one first")
    return kind.write(drawings)


def kind_of(path: Path) -> Kind:
    """Return the kind of a file. Raises StrokeFileError for others."""
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        raise StrokeFileError(f"{path.name}: only {', '.join(KINDS)} files hold strokes")
    return kind
