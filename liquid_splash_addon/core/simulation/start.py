# SPDX-License-Identifier: GPL-3.0-or-later
"""What a simulation starts from: the liquid, and what of the scene acts on it.

All in the splash's local space, metres and seconds; the caller turns a scene over to it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..liquid.fields import pack_near, unpack_near
from ..liquid.level_set import LevelSet
from ..mesh.mesh import Mesh
from ..obstacles.obstacles import AUTO

FAR = 4.0
"""Cells from the surface beyond which a start's level is not kept."""


class LooseDrops(NamedTuple):
    """Drops that fly free.

    Attributes
    ----------
    positions : float32 ``(n, 3)``, metres; velocities : float32 ``(n, 3)``, m/s
    radii : float32 ``(n,)``, metres
    """

    positions: np.ndarray
    velocities: np.ndarray
    radii: np.ndarray

    @classmethod
    def none(cls) -> LooseDrops:
        """Return no drops."""
        nothing = np.zeros((0, 3), dtype=np.float32)
        return cls(nothing, nothing, nothing[:, 0])


@dataclass(frozen=True)
class MovingObstacle:
    """A triangle mesh that liquid keeps out of, at rest or moving.

    Attributes
    ----------
    poses : float32 ``(p, n, 3)``, metres: the vertices at every frame, from the first on; in
        between they move straight. ``p`` is 1 for one at rest; after the last pose it stays.
    faces : int32 ``(m, 3)``
    name : for messages
    kind : what it is to count as, see ``obstacles.obstacle_from_mesh``
    """

    poses: np.ndarray
    faces: np.ndarray
    name: str = ""
    kind: str = AUTO


@dataclass(frozen=True)
class Start:
    """The start of a simulation.

    Attributes
    ----------
    liquid : shape and velocity, refined as the splash is seen, local metres and m/s
    frame_seconds : seconds of the liquid's own time from one frame to the next: the scene's frame
        times the time scale
    up : float64 ``(3,)``, the direction against gravity
    ground : how far the floor or the pool's surface lies along ``up`` from the origin, metres; of
        use where the settings have a ground
    drops : those that fly free
    obstacles : what the liquid keeps out of
    """

    liquid: LevelSet
    frame_seconds: float
    up: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    ground: float = 0.0
    drops: LooseDrops = field(default_factory=LooseDrops.none)
    obstacles: tuple[MovingObstacle, ...] = ()

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return the start as plain arrays by name, for a job's file."""
        near = self.liquid.level < FAR
        arrays = {
            **pack_near(near, self.liquid.grid),
            "level": self.liquid.level[near],
            "velocity": self.liquid.velocity[:, near],
            "up": np.asarray(self.up, dtype=np.float64),
            "numbers": np.array([self.frame_seconds, self.ground]),
            "drops": np.column_stack(self.drops).astype(np.float32),
            "names": np.array([obstacle.name for obstacle in self.obstacles], dtype=np.str_),
        }
        for number, obstacle in enumerate(self.obstacles):
            arrays[f"poses_{number}"] = np.asarray(obstacle.poses, dtype=np.float32)
            arrays[f"faces_{number}"] = np.asarray(obstacle.faces, dtype=np.int32)
        if any(obstacle.kind != AUTO for obstacle in self.obstacles):
            arrays["kinds"] = np.array(
                [obstacle.kind for obstacle in self.obstacles], dtype=np.str_
            )
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> Start:
        """Return the start of :meth:`to_arrays`; KeyError or ValueError if it is none."""
        near, grid = unpack_near(arrays)
        level = np.full(grid.shape, FAR, dtype=np.float32)
        level[near] = arrays["level"]
        velocity = np.zeros((3, *grid.shape), dtype=np.float32)
        velocity[:, near] = arrays["velocity"]
        drops = arrays["drops"]
        names = arrays["names"]
        kinds = arrays.get("kinds", np.full(len(names), AUTO))
        obstacles = tuple(
            MovingObstacle(arrays[f"poses_{n}"], arrays[f"faces_{n}"], str(name), str(kind))
            for n, (name, kind) in enumerate(zip(names, kinds, strict=True))
        )
        frame_seconds, ground = (float(value) for value in arrays["numbers"])
        return cls(
            LevelSet(level, velocity, grid), frame_seconds, arrays["up"], ground,
            LooseDrops(drops[:, :3], drops[:, 3:6], drops[:, 6]), obstacles,
        )  # fmt: skip

    def key(self) -> str:
        """Return what differs for another start: a hash of all of it."""
        found = hashlib.sha256()
        for name, array in sorted(self.to_arrays().items()):
            found.update(f"{name} {array.dtype} {array.shape} ".encode())
            found.update(np.ascontiguousarray(array).tobytes())
        return found.hexdigest()[:32]


@dataclass(frozen=True)
class Frame:
    """One frame of a simulation, in the splash's local space, metres and m/s.

    Attributes
    ----------
    mesh : the surface, watertight, with velocities
    drops : small drops that fly free; they are not in the mesh
    left : share of all liquid that has left the domain, 0..1
    """

    mesh: Mesh
    drops: LooseDrops
    left: float = 0.0
