# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a simulation as they lie on disk: one file a scene, in the scene's own frame.

A file is a NumPy ``.npz``. ``scene`` is a JSON string with the scene's parameters; frame ``f``
is in the arrays ``f/distance`` (int8, +-127 is +-BAND cells), ``f/velocity`` (float16 m/s,
``(n, 3)``, on cells twice as large, one row for each that holds a cell with distance < BAND,
in C order), ``f/start`` (the cell of the box at which the arrays begin) and ``f/time``
(seconds since impact).
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from liquid_splash_addon.core.fluid.surface import BAND


@dataclass(frozen=True)
class Frame:
    """The liquid at one moment, on the part of the simulation's grid that holds it.

    Attributes
    ----------
    distance : int8 ``(X, Y, Z)``, signed distance in BAND / 127 cells; X, Y, Z are even
    velocity : float16 ``(n, 3)`` m/s on the blocks of 2^3 cells that :func:`near_blocks` marks
    start : int ``(3,)``, first cell of the arrays in the simulation's box
    time : seconds since impact
    """

    distance: np.ndarray
    velocity: np.ndarray
    start: np.ndarray
    time: float

    def distance_cells(self) -> np.ndarray:
        """Return the signed distance in cells, float32 ``(X, Y, Z)``."""
        return self.distance.astype(np.float32) * np.float32(BAND / 127)

    def dense_velocity(self) -> np.ndarray:
        """Return the velocity on blocks of 2^3 cells, float32 ``(X/2, Y/2, Z/2, 3)`` m/s.

        Zero far from the liquid.
        """
        near = near_blocks(self.distance)
        dense = np.zeros((*near.shape, 3), dtype=np.float32)
        dense[near] = self.velocity
        return dense


def make_frame(distance: np.ndarray, velocity: np.ndarray, start: np.ndarray, time: float) -> Frame:
    """Return a frame from a distance in cells ``(X, Y, Z)`` and a velocity ``(X, Y, Z, 3)``, m/s.

    Velocity is averaged over blocks of 2^3 cells (it is smooth: pressure has made it so);
    cells with velocity zero count as unknown.
    """
    packed = pack_distance(distance)
    known = in_blocks(velocity.any(axis=-1)).sum(axis=-1)
    sums = np.stack([in_blocks(velocity[..., a]).sum(axis=-1) for a in range(3)], axis=-1)
    means = sums / np.maximum(known, 1)[..., None]
    return Frame(packed, means[near_blocks(packed)].astype(np.float16), start, time)


def in_blocks(field: np.ndarray) -> np.ndarray:
    """Return ``(X, Y, Z)`` as ``(X/2, Y/2, Z/2, 8)``: the eight cells of each block together."""
    x, y, z = (n // 2 for n in field.shape)
    return field.reshape(x, 2, y, 2, z, 2).transpose(0, 2, 4, 1, 3, 5).reshape(x, y, z, 8)


def near_blocks(packed: np.ndarray) -> np.ndarray:
    """Return which blocks of 2^3 cells hold a cell with distance < BAND, bool."""
    return np.asarray((in_blocks(packed) < 127).any(axis=-1))


def pack_distance(distance: np.ndarray) -> np.ndarray:
    """Return a distance in cells as int8; BAND and more become 127."""
    return np.clip(np.round(distance * (127 / BAND)), -127, 127).astype(np.int8)


def save_scene(path: Path, parameters: dict[str, Any], frames: Sequence[Frame]) -> None:
    """Write a scene so that a file of this name is always whole (written aside, then renamed)."""
    arrays = {"scene": np.array(json.dumps(parameters))}
    for number, frame in enumerate(frames):
        for name in ("distance", "velocity", "start", "time"):
            arrays[f"{number}/{name}"] = np.asarray(getattr(frame, name))
    save_arrays(path, arrays)


def save_arrays(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write a compressed ``.npz`` aside and rename it into place."""
    aside = path.with_suffix(f".{os.getpid()}.tmp")
    with open(aside, "wb") as file:
        np.savez_compressed(file, **arrays)
        file.flush()
        os.fsync(file.fileno())
    os.replace(aside, path)


def load_scene(path: Path) -> tuple[dict[str, Any], list[Frame]]:
    """Return a scene's parameters and frames."""
    with np.load(path) as data:
        parameters = json.loads(str(data["scene"]))
        return parameters, [read_frame(data, n) for n in range(parameters["frames"])]


def load_parameters(path: Path) -> tuple[dict[str, Any], list[float]]:
    """Return a scene's parameters and its frames' times."""
    with np.load(path) as data:
        parameters = json.loads(str(data["scene"]))
        return parameters, [float(data[f"{n}/time"]) for n in range(parameters["frames"])]


def load_frame(path: Path, number: int) -> Frame:
    """Return one frame of a scene."""
    with np.load(path) as data:
        return read_frame(data, number)


def read_frame(data: Any, number: int) -> Frame:
    """Return one frame of an open scene file."""
    distance, velocity, start = (data[f"{number}/{k}"] for k in ("distance", "velocity", "start"))
    return Frame(distance, velocity, start, float(data[f"{number}/time"]))


def scene_path(directory: Path, seed: int) -> Path:
    """Return where the scene with this seed lies."""
    return directory / f"scene_{seed:06d}.npz"
