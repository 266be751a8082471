# SPDX-License-Identifier: GPL-3.0-or-later
"""Mantaflow's cache: gzip streams of grids, particles and the configuration of a frame.

Layouts as in Mantaflow's ``iogrids.cpp`` and ``ioparticles.cpp`` and Blender's ``MANTA_main.cpp``.
Little endian; x runs fastest, so an array ``(X, Y, Z)`` is written as its transpose.
"""

from __future__ import annotations

import gzip
import os
import struct
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .domain import TIME_UNIT, Domain
from .first_frame import FirstFrame

GRID_HEADER = struct.Struct("<4s6i252siQ")
"""Magic, shape, kind of grid, kind of element, its bytes, notes, fourth dimension, time stamp."""

POINTS_HEADER = struct.Struct("<4s6i256sQ")
"""Magic, count, shape, kind of element, its bytes, notes, time stamp."""

GRID, POINTS, POINT_DATA = b"MNT3", b"PB02", b"PD01"
LEVEL, FACES = 17, 12
"""Kinds of grids: a level set, vectors on lower faces."""

REAL, VECTOR = 1, 2
"""Kinds of elements of a grid."""

POINT = np.dtype([("position", "<3f4"), ("flag", "<i4")])
DEAD = 1 << 10
"""Flag of a particle that Mantaflow has deleted."""

UNIT_STEPS_PER_SECOND = 1 / TIME_UNIT

DATA = ("vel", "pVel", "pp", "phi")
"""What a frame needs, for the solver to go on from it."""


class Timing(NamedTuple):
    """When a frame is.

    Attributes
    ----------
    frame : its number
    fps : frames per second of the scene
    time_scale : seconds of the liquid per second of the scene
    """

    frame: int
    fps: float
    time_scale: float

    @property
    def step(self) -> float:
        """A frame in units of Mantaflow's time."""
        return UNIT_STEPS_PER_SECOND / self.fps * self.time_scale


class CacheError(ValueError):
    """A cache cannot be written or read; the message says what to do."""


def data_path(cache: Path, name: str, frame: int) -> Path:
    """Return the file of a grid or of particles."""
    return cache / "data" / f"{name}_{frame:04d}.uni"


def config_path(cache: Path, frame: int) -> Path:
    """Return the file of a frame's configuration."""
    return cache / "config" / f"config_{frame:04d}.uni"


def write_frame(cache: Path, first: FirstFrame, timing: Timing) -> int:
    """Write a splash as a frame that a bake goes on from; return the bytes that it took.

    All files or none are there afterwards. Raises CacheError where they cannot be written.
    """
    x, y, z = first.domain.shape
    count = len(first.positions)
    points = np.zeros(count, dtype=POINT)
    points["position"] = first.positions
    contents = {
        data_path(cache, "phi", timing.frame): grid_bytes(first.level, LEVEL),
        data_path(cache, "vel", timing.frame): grid_bytes(first.faces, FACES),
        data_path(cache, "pp", timing.frame): POINTS_HEADER.pack(
            POINTS, count, x, y, z, 0, POINT.itemsize, b"", 0
        ) + points.tobytes(),
        data_path(cache, "pVel", timing.frame): POINTS_HEADER.pack(
            POINT_DATA, count, x, y, z, 1, 12, b"", 0
        ) + first.velocities.astype("<f4").tobytes(),
        config_path(cache, timing.frame): config_bytes(first.domain, timing),
    }  # fmt: skip
    written: list[tuple[Path, Path]] = []
    try:
        for path, content in contents.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            partial = path.with_suffix(".part")
            written.append((partial, path))
            with gzip.open(partial, "wb", compresslevel=1) as file:
                file.write(content)
        total = sum(partial.stat().st_size for partial, _ in written)
        for partial, path in written:
            os.replace(partial, path)
    except OSError as error:
        for partial, _ in written:
            partial.unlink(missing_ok=True)
        raise CacheError(cannot_write(cache, error)) from error
    return total


def cannot_write(cache: Path, error: OSError) -> str:
    """Return the sentence about a folder that cannot be written."""
    return (
        f"The cache folder {cache} cannot be written ({error.strerror or error}): make room, or "
        "choose another in the Cache panel"
    )


def grid_bytes(values: np.ndarray, kind: int) -> bytes:
    """Return a grid's file; values : ``(X, Y, Z)``, or ``(3, X, Y, Z)`` for vectors."""
    is_vector = values.ndim == 4
    element, size = (VECTOR, 12) if is_vector else (REAL, 4)
    ordered = values.transpose(3, 2, 1, 0) if is_vector else values.transpose(2, 1, 0)
    header = GRID_HEADER.pack(GRID, *values.shape[-3:], kind, element, size, b"", 0, 0)
    return header + np.ascontiguousarray(ordered, dtype="<f4").tobytes()


def config_bytes(domain: Domain, timing: Timing) -> bytes:
    """Return a frame's configuration; the domain stands unturned at its middle."""
    half = [float(value) / 2 for value in domain.size]
    low, high = [-value for value in half], half
    place = np.eye(4)
    place[3, :3] = domain.middle  # column by column
    shape, none = domain.shape, (0, 0, 0)
    return struct.pack(
        "<4i2f9f6i16f9i3ff4s",
        0, *shape, 1 / domain.longest, timing.step,
        *low, *high, *low, *none, *none,
        *place.ravel(), *shape, *none, *shape, *none, timing.step, b"C01\0",
    )  # fmt: skip


def contents_of(path: Path) -> bytes:
    """Return what a file holds. Raises CacheError where it is not there, or damaged."""
    try:
        with gzip.open(path, "rb") as file:
            return file.read()
    except (OSError, EOFError, zlib.error) as error:
        raise CacheError(f"{path} cannot be read ({error}): export the splash again") from error


def read_grid(path: Path) -> np.ndarray:
    """Return a grid, float32 ``(X, Y, Z)`` or ``(3, X, Y, Z)``. Raises CacheError."""
    content = contents_of(path)
    if len(content) < GRID_HEADER.size or content[:4] != GRID:
        raise CacheError(f"{path} is not a grid of Mantaflow: export the splash again")
    _, x, y, z, _, element, size, *_ = GRID_HEADER.unpack_from(content)
    kind = "<i4" if element == 0 else "<f4"
    if len(content) != GRID_HEADER.size + x * y * z * size:
        raise CacheError(f"{path} is cut off: export the splash again")
    values = np.frombuffer(content, dtype=kind, offset=GRID_HEADER.size)
    if size == 12:
        return values.reshape(z, y, x, 3).transpose(3, 2, 1, 0)
    return values.reshape(z, y, x).transpose(2, 1, 0)


def read_particles(cache: Path, frame: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the particles' positions (cells) and velocities, ``(n, 3)`` each. Raises CacheError.

    Those that Mantaflow has deleted are left out.
    """
    found = []
    for name, magic, kind in (("pp", POINTS, POINT), ("pVel", POINT_DATA, np.dtype("<3f4"))):
        path = data_path(cache, name, frame)
        content = contents_of(path)
        if content[:4] != magic or (len(content) - POINTS_HEADER.size) % kind.itemsize:
            raise CacheError(f"{path} holds no particles of Mantaflow: export the splash again")
        found.append(np.frombuffer(content, dtype=kind, offset=POINTS_HEADER.size))
    points, velocities = found
    alive = points["flag"] & DEAD == 0
    return points["position"][alive], velocities[alive]


def has_frame(cache: Path, frame: int) -> bool:
    """Whether all files of a frame are there."""
    paths = [data_path(cache, name, frame) for name in DATA]
    return all(path.is_file() for path in [*paths, config_path(cache, frame)])


def drop_later(cache: Path, frame: int) -> None:
    """Delete what an earlier bake made of later frames, and every mesh. Raises CacheError."""
    try:
        for folder in ("data", "config", "mesh"):
            for path in (cache / folder).glob("*_[0-9][0-9][0-9][0-9]*"):
                digits = path.name.split(".")[0].rpartition("_")[2]
                if digits.isdigit() and (folder == "mesh" or int(digits) > frame):
                    path.unlink()
    except OSError as error:
        raise CacheError(cannot_write(cache, error)) from error
