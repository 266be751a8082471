# SPDX-License-Identifier: GPL-3.0-or-later
"""A simulation's folder: one compressed file a frame, and a manifest of what they were made from.

Every file is written beside its place and then moved there, so that none is ever half there.
"""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..mesh.mesh import Mesh
from ..whole_file import write_whole
from .start import Frame, LooseDrops

VERSION = 1
"""Of the folder's files."""

MANIFEST = "simulation.json"

UNREADABLE = (ValueError, KeyError, OSError, EOFError, zipfile.BadZipFile, zlib.error)
"""What reading a damaged or missing file raises."""


def frame_path(folder: Path, index: int) -> Path:
    """Return where frame ``index`` is kept; 0 is the splash as it starts."""
    return folder / f"frame_{index:05d}.npz"


def write_frame(folder: Path, index: int, frame: Frame) -> None:
    """Write a frame. Raises OSError with a sentence that says what to do."""
    arrays = {
        "vertices": frame.mesh.vertices,
        "faces": frame.mesh.faces,
        "velocities": frame.mesh.velocities.astype(np.float16),
        "drops": np.column_stack(frame.drops).astype(np.float32),
        "left": np.array(frame.left),
    }
    write_saying(frame_path(folder, index), packed(arrays, 1))


def read_frame(folder: Path | str, index: int) -> Frame:
    """Return frame ``index``, 0 for the start.

    Raises OSError (not there) or ValueError (damaged), with a sentence for the user.
    """
    path = frame_path(Path(folder), index)
    try:
        arrays = unpacked(path)
        mesh = Mesh(arrays["vertices"], arrays["faces"], arrays["velocities"].astype(np.float32))
        drops = arrays["drops"]
        found = LooseDrops(drops[:, :3], drops[:, 3:6], drops[:, 6])
        return Frame(mesh, found, float(arrays["left"]))
    except FileNotFoundError:
        raise FileNotFoundError(
            f"Frame {index} of the simulation is not in {folder}: simulate it"
        ) from None
    except UNREADABLE as error:
        raise ValueError(f"{path} is damaged: delete it and simulate again") from error


def frames_done(folder: Path | str) -> int:
    """Return how many frames are there, the first (0) included, without a gap."""
    folder, count = Path(folder), 0
    while frame_path(folder, count).is_file():
        count += 1
    return count


def read_manifest(folder: Path | str) -> dict[str, Any]:
    """Return the manifest; empty where there is none, or none that can be read.

    It holds ``version``, ``key`` (of everything that the frames are made from), ``frames`` (how
    many are wanted after the first), ``frame_seconds`` and ``cell`` (metres).
    """
    try:
        found = json.loads((Path(folder) / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) and found.get("version") == VERSION else {}


def write_manifest(folder: Path, values: Mapping[str, Any]) -> None:
    """Write the manifest. Raises OSError with a sentence that says what to do."""
    text = json.dumps({"version": VERSION, **values}, indent=1)
    write_saying(folder / MANIFEST, text.encode())


def packed(arrays: Mapping[str, np.ndarray], level: int) -> bytes:
    """Return arrays as the bytes of an .npz file; level : of compression, 0 for none."""
    buffer = io.BytesIO()
    method = zipfile.ZIP_DEFLATED if level else zipfile.ZIP_STORED
    with zipfile.ZipFile(buffer, "w", method, compresslevel=level or None) as file:
        for name, array in arrays.items():
            with file.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.save(entry, np.asarray(array, order="C"), allow_pickle=False)
    return buffer.getvalue()


def unpacked(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays of an .npz file; one of UNREADABLE where that is not possible."""
    with np.load(path, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


def write_saying(path: Path, content: bytes) -> None:
    """Write a file in whole. Raises OSError with a sentence that says what to do."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, content)
    except OSError as error:
        raise OSError(
            error.errno,
            f"The simulation cannot be written ({error.strerror}): make room, or choose a "
            "folder that can be written to",
            str(path),
        ) from error
