# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a simulation as they lie on disk: one file a scene, in the scene's own frame.

A file is a NumPy ``.npz`` whose members are packed by bzip2 and checked by CRC-32 on reading.
``scene`` is a JSON string with the scene's parameters; ``levels`` the distances, in cells, that
the codes stand for. Frame ``f`` is in the arrays ``f/distance`` (int8 codes: sign and number of
the level), ``f/velocity`` (int16, ``(3, n)``, units of 0.05 m/s, on cells twice as large, one
column for each that holds a cell with distance < 1.5, in C order), ``f/start`` (the cell of the
box at which the arrays begin), ``f/droplets`` (float16 ``(n, 7)``: position m, velocity m/s,
radius m of spray finer than a cell) and ``f/time`` (seconds since impact).
"""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

LEVELS = np.array(
    [0.0, 0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.7, 0.9, 1.25, 1.75, 2.45, 3.0], dtype=np.float32
)
"""Distances that codes 1 to 12 stand for, cells (code 0 is not used: it has no sign). Fine near
the surface, coarse where only a clipped distance is asked for."""

NEAR_CODE = 9
"""Blocks that hold a code of at most this (distance < 1.5) have a velocity."""

SCENE_PREFIX = "scene_"
"""Before the seed in the names of scenes' files."""

VELOCITY_STEP = 0.05
"""m/s of one unit of the stored velocity."""


@dataclass(frozen=True)
class StoredFrame:
    """The liquid at one moment, on the part of the stored grid that holds it.

    Attributes
    ----------
    distance : int8 ``(X, Y, Z)``, codes of the signed distance; X, Y, Z are even
    velocity : int16 ``(3, n)``, VELOCITY_STEP m/s, on the blocks that :func:`near_blocks` marks
    start : int ``(3,)``, first cell of the arrays in the simulation's box
    droplets : float16 ``(n, 7)``: position (m, from the box's corner), velocity (m/s), radius (m)
    time : seconds since impact
    """

    distance: np.ndarray
    velocity: np.ndarray
    start: np.ndarray
    droplets: np.ndarray
    time: float

    @cached_property
    def signed_distance(self) -> np.ndarray:
        """Signed distance in cells, float32 ``(X, Y, Z)``, clipped at +-3."""
        table = np.concatenate([-LEVELS[:0:-1], LEVELS])
        return np.asarray(table[self.distance.astype(np.intp) + len(LEVELS) - 1])

    @cached_property
    def block_velocity(self) -> np.ndarray:
        """Velocity on blocks of 2^3 cells, float32 ``(X/2, Y/2, Z/2, 3)`` m/s, zero far away."""
        near = near_blocks(self.distance)
        dense = np.zeros((*near.shape, 3), dtype=np.float32)
        dense[near] = self.velocity.T * np.float32(VELOCITY_STEP)
        return dense


def pack_distance(distance: np.ndarray) -> np.ndarray:
    """Return the int8 codes of a signed distance in cells."""
    edges = (LEVELS[1:-1] + LEVELS[2:]) / 2
    size = np.abs(distance)
    code = np.full(distance.shape, len(LEVELS) - 1, dtype=np.int8)
    near = size < edges[-1]  # a small part of the box
    code[near] = np.digitize(size[near], edges) + 1
    return np.where(distance < 0, -code, code)


def pack_velocity(velocity: np.ndarray) -> np.ndarray:
    """Return velocities ``(n, 3)`` m/s as they are stored, int16 ``(3, n)``."""
    limit = np.iinfo(np.int16).max
    return np.clip(np.round(velocity.T / VELOCITY_STEP), -limit, limit).astype(np.int16)


def in_blocks(field: np.ndarray) -> np.ndarray:
    """Return ``(X, Y, Z)`` as ``(X/2, Y/2, Z/2, 8)``: the eight cells of each block together."""
    x, y, z = (n // 2 for n in field.shape)
    return field.reshape(x, 2, y, 2, z, 2).transpose(0, 2, 4, 1, 3, 5).reshape(x, y, z, 8)


def near_blocks(codes: np.ndarray) -> np.ndarray:
    """Return which blocks of 2^3 cells hold liquid or cells just beside it, bool."""
    near = codes <= NEAR_CODE
    near = near[::2] | near[1::2]
    near = near[:, ::2] | near[:, 1::2]
    return np.asarray(near[:, :, ::2] | near[:, :, 1::2])


def pack_scene(parameters: dict[str, Any], frames: Sequence[StoredFrame]) -> bytes:
    """Return the file of a scene; the frames' times go into its parameters."""
    times = [frame.time for frame in frames]
    header = json.dumps({**parameters, "times": times})
    arrays = {"scene": np.array(header), "levels": LEVELS}
    for number, frame in enumerate(frames):
        for name in ("distance", "velocity", "start", "droplets", "time"):
            arrays[f"{number}/{name}"] = np.asarray(getattr(frame, name))
    file = io.BytesIO()
    # numpy.load reads what zipfile reads; numpy.savez can only deflate, which is twice as large.
    with zipfile.ZipFile(file, "w", zipfile.ZIP_BZIP2) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w") as member:
                np.save(member, array, allow_pickle=False)
    return file.getvalue()


def write_whole(path: Path, content: bytes) -> None:
    """Write a file aside and rename it into place: a file of this name is always whole."""
    aside = path.with_suffix(f".{os.getpid()}.tmp")
    try:
        with open(aside, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(aside, path)
    except OSError:
        aside.unlink(missing_ok=True)
        raise


def load_scene(path: Path) -> tuple[dict[str, Any], list[StoredFrame]]:
    """Return a scene's parameters and frames."""
    with np.load(path) as data:
        parameters = json.loads(str(data["scene"]))
        return parameters, [read_frame(data, n) for n in range(len(parameters["times"]))]


def load_parameters(path: Path) -> dict[str, Any]:
    """Return a scene's parameters, its frames' ``times`` among them."""
    with np.load(path) as data:
        return dict(json.loads(str(data["scene"])))


def load_frame(path: Path, number: int) -> StoredFrame:
    """Return one frame of a scene."""
    with np.load(path) as data:
        return read_frame(data, number)


def read_frame(data: Any, number: int) -> StoredFrame:
    """Return one frame of an open scene file."""
    names = ("distance", "velocity", "start", "droplets")
    distance, velocity, start, droplets = (data[f"{number}/{name}"] for name in names)
    return StoredFrame(distance, velocity, start, droplets, float(data[f"{number}/time"]))


def scene_path(directory: Path, seed: int) -> Path:
    """Return where the scene with this seed lies."""
    return directory / f"{SCENE_PREFIX}{seed:06d}.npz"


def seed_of(path: Path) -> int:
    """Return the seed of the scene that :func:`scene_path` named so, of however many digits."""
    return int(path.stem.removeprefix(SCENE_PREFIX))
