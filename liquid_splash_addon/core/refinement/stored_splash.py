# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file keeps of a splash, in one versioned and compressed container.

A container is an .npz archive of plain arrays. It holds the generator's fields and the strokes that
they were made of, once refinements were applied, the refined liquid, and, once that was flown on,
the liquid some time later.
"""

from __future__ import annotations

import io
import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from zipfile import BadZipFile

import numpy as np

from ..liquid.fields import AIR, Fields, pack_near, unpack_near
from ..liquid.level_set import LevelSet
from ..mesh.mesh import Mesh
from ..sketch.strokes import Stroke
from .drop_meshes import DropCloud
from .settings import SheetSettings, WaveSettings

VERSION = 3
"""Of the container, the newest that is read. Files from before versions hold the fields' arrays
alone. Written is the oldest that holds all there is, which older add-ons read too: 3 with applied
sheets, 2 for what was flown on, else 1."""


@dataclass(frozen=True)
class Applied:
    """Refinements that were applied: no longer in the list, but kept.

    Attributes
    ----------
    liquid : the refined liquid, before obstacles are carved out
    cloud : the drops that fly free
    waves : the waves on its mesh, first to last
    sheets : the films and rims that its mesh has before, if it has
    """

    liquid: LevelSet
    cloud: DropCloud
    waves: tuple[WaveSettings, ...] = ()
    sheets: SheetSettings | None = None


@dataclass(frozen=True)
class Flowed:
    """A splash that was flown on: what all refinements of its list start from.

    Attributes
    ----------
    liquid : the liquid, its free drops included, before obstacles are carved out
    milliseconds : of its own time after the splash that it was made from
    """

    liquid: LevelSet
    milliseconds: float


@dataclass(frozen=True)
class StoredSplash:
    """A splash as it is stored.

    Attributes
    ----------
    fields : what the generator gave, rounded as :meth:`Fields.round_off` does
    strokes : what it was made of, local metres and m/s; none in files from before they were kept
    applied : the refinements that were applied to it, if there are any
    flowed : the liquid, applied refinements included, some time later, if it was flown on
    seed : that the seeds of refinements follow; 0 in files from before it was kept
    """

    fields: Fields
    strokes: Sequence[Stroke] = field(default_factory=tuple)
    applied: Applied | None = None
    flowed: Flowed | None = None
    seed: int = 0

    @property
    def version(self) -> int:
        """The oldest version of the container that holds it."""
        if self.applied is not None and self.applied.sheets is not None:
            return VERSION
        return 1 if self.flowed is None else 2

    def to_bytes(self) -> bytes:
        """Return the container, a megabyte or two."""
        arrays = {"version": np.array(self.version), "seed": np.array(self.seed)}
        arrays |= prefixed("fields", self.fields.to_arrays())
        arrays |= prefixed("strokes", stroke_arrays(self.strokes))
        if self.applied is not None:
            arrays |= prefixed("applied", level_arrays(self.applied.liquid))
            arrays |= prefixed("cloud", cloud_arrays(self.applied.cloud))
            waves = json.dumps([asdict(step) for step in self.applied.waves])
            arrays["waves"] = np.frombuffer(waves.encode(), dtype=np.uint8)
            if self.applied.sheets is not None:
                sheets = json.dumps(asdict(self.applied.sheets))
                arrays["sheets"] = np.frombuffer(sheets.encode(), dtype=np.uint8)
        if self.flowed is not None:
            arrays |= prefixed("flowed", level_arrays(self.flowed.liquid))
            arrays["milliseconds"] = np.array(self.flowed.milliseconds)
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **arrays)
        return buffer.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes) -> StoredSplash:
        """Return the splash of a container; ValueError if ``data`` is none that can be read."""
        try:
            with np.load(io.BytesIO(data), allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
            version = int(arrays.get("version", np.array(0)))
            if version == 0:
                return cls(Fields.from_arrays(arrays))
            if version <= VERSION:
                return read_arrays(arrays)
        except (
            ValueError,
            KeyError,
            TypeError,
            EOFError,
            OSError,
            BadZipFile,
            zlib.error,
        ) as error:
            raise ValueError("The stored liquid is damaged: generate the splash again") from error
        raise ValueError(
            "The splash was stored by a later version of Liquid Splash: update the extension, or "
            "generate the splash again"
        )


def strokes_of(data: bytes) -> tuple[Stroke, ...]:
    """Return the strokes of a container alone, in a millisecond; none if it cannot be read."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as stored:
            names = [name for name in stored.files if name.startswith("strokes_")]
            return read_strokes(without_prefix("strokes", {name: stored[name] for name in names}))
    except (ValueError, KeyError, TypeError, EOFError, OSError, BadZipFile, zlib.error):
        return ()


def read_arrays(arrays: Mapping[str, np.ndarray]) -> StoredSplash:
    """Return the splash of a container's arrays; KeyError or ValueError if they are incomplete."""
    applied = None
    if "waves" in arrays:
        waves = json.loads(arrays["waves"].tobytes())
        sheets = json.loads(arrays["sheets"].tobytes()) if "sheets" in arrays else None
        applied = Applied(
            read_level(without_prefix("applied", arrays)),
            read_cloud(without_prefix("cloud", arrays)),
            tuple(WaveSettings(**settings) for settings in waves),
            None if sheets is None else SheetSettings(**sheets),
        )
    flowed = None
    if "milliseconds" in arrays:
        liquid = read_level(without_prefix("flowed", arrays))
        flowed = Flowed(liquid, float(arrays["milliseconds"]))
    return StoredSplash(
        Fields.from_arrays(without_prefix("fields", arrays)),
        read_strokes(without_prefix("strokes", arrays)),
        applied,
        flowed,
        int(arrays.get("seed", np.array(0))),
    )


def prefixed(prefix: str, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the arrays under longer names."""
    return {f"{prefix}_{name}": array for name, array in arrays.items()}


def without_prefix(prefix: str, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the arrays that :func:`prefixed` has named."""
    start = f"{prefix}_"
    return {
        name.removeprefix(start): array for name, array in arrays.items() if name.startswith(start)
    }


def level_arrays(liquid: LevelSet) -> dict[str, np.ndarray]:
    """Return a level set where it is nearer to liquid than AIR, in full precision.

    Rounded, what was applied would not be the mesh that was seen.
    """
    near = liquid.level < AIR
    return {
        **pack_near(near, liquid.grid),
        "level": liquid.level[near],
        "velocity": liquid.velocity[:, near],
    }


def read_level(arrays: Mapping[str, np.ndarray]) -> LevelSet:
    """Return the level set of :func:`level_arrays`; air elsewhere."""
    near, grid = unpack_near(arrays)
    level = np.full(grid.shape, AIR, dtype=np.float32)
    level[near] = arrays["level"]
    velocity = np.zeros((3, *grid.shape), dtype=np.float32)
    velocity[:, near] = arrays["velocity"]
    return LevelSet(level, velocity, grid)


def stroke_arrays(strokes: Sequence[Stroke]) -> dict[str, np.ndarray]:
    """Return the points and velocities of all strokes, and how many points each has."""
    nothing = np.zeros((0, 3), dtype=np.float32)
    return {
        "points": np.concatenate([nothing, *(stroke.points for stroke in strokes)]),
        "velocities": np.concatenate([nothing, *(stroke.velocities for stroke in strokes)]),
        "counts": np.array([len(stroke.points) for stroke in strokes], dtype=np.int64),
    }


def read_strokes(arrays: Mapping[str, np.ndarray]) -> tuple[Stroke, ...]:
    """Return the strokes of :func:`stroke_arrays`."""
    ends = np.cumsum(arrays["counts"])[:-1]
    points, velocities = (np.split(arrays[name], ends) for name in ("points", "velocities"))
    if not len(arrays["counts"]):
        return ()
    return tuple(Stroke(p, v) for p, v in zip(points, velocities, strict=True))


CLOUD = ("positions", "velocities", "radii", "meshed", "owner")
MESH = ("vertices", "faces", "velocities")


def cloud_arrays(cloud: DropCloud) -> dict[str, np.ndarray]:
    """Return the drops and their meshes."""
    arrays = {name: getattr(cloud, name) for name in CLOUD}
    return arrays | {f"mesh_{name}": getattr(cloud.mesh, name) for name in MESH}


def read_cloud(arrays: Mapping[str, np.ndarray]) -> DropCloud:
    """Return the drops of :func:`cloud_arrays`."""
    mesh = Mesh(*(arrays[f"mesh_{name}"] for name in MESH))
    return DropCloud(mesh=mesh, **{name: arrays[name] for name in CLOUD})
