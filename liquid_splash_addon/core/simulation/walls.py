# SPDX-License-Identifier: GPL-3.0-or-later
"""What the liquid keeps out of: ground, basin and obstacles, as the solver's solids, in cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..compiling import njit
from ..fluid.collision import MovingSolid, Solid
from ..mesh.hole_filling import hole_edges, spanned, weld, welded_faces
from ..mesh.signed_distance import closest_on_triangle, owned_distance, winding_on_grid
from ..numeric.trilinear import sample_field
from ..obstacles.obstacles import SHELL_CELLS, ObstacleError, obstacle_from_mesh
from .domain import Domain
from .start import MovingObstacle

NOWHERE = 1e6
"""Distance from what is not there, cells."""

WALL_BAND = 5.0
"""Cells around an obstacle's surface up to which its distance is known. Walls move less than a cell
a step, so no particle is ever deeper."""


class Nothing:
    """An empty domain."""

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return a large distance ``(n,)``."""
        return np.full(len(points), NOWHERE)

    def velocity(self, points: np.ndarray) -> np.ndarray:
        """Return zero ``(n, 3)``."""
        return np.zeros(points.shape)


@dataclass(frozen=True)
class Floor(Nothing):
    """All that lies below ``height``."""

    height: float

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance ``(n,)``."""
        return np.asarray(points[:, 2] - self.height, dtype=np.float64)


@dataclass(frozen=True)
class Basin(Nothing):
    """A floor with a box sunk into it, open above, from ``low`` to ``high`` ``(3,)``."""

    low: np.ndarray
    high: np.ndarray

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance ``(n,)``; too short beyond the edges of the box."""
        inner = np.minimum(points[:, :2] - self.low[:2], self.high[:2] - points[:, :2])
        sides = np.maximum(inner.min(axis=1), points[:, 2] - self.high[2])
        return np.asarray(np.minimum(points[:, 2] - self.low[2], sides), dtype=np.float64)


@dataclass(frozen=True)
class Voxels:
    """An obstacle at one moment, on the cells around it.

    Attributes
    ----------
    level : float32 ``(1, X, Y, Z)``, signed distance at the cells' centres, within +-WALL_BAND
    speed : float32 ``(3, X, Y, Z)``, cells/s, of the nearest piece of its surface; None at rest
    start : int ``(3,)``, the cell at which the arrays begin
    """

    level: np.ndarray
    speed: np.ndarray | None
    start: np.ndarray

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance ``(n,)``; NOWHERE outside of the arrays."""
        inside = self.holds(points)
        out = np.full(len(points), NOWHERE)
        out[inside] = sample_field(self.level, points[inside] - self.start)[:, 0]
        return out

    def velocity(self, points: np.ndarray) -> np.ndarray:
        """Return the velocity ``(n, 3)`` of its surface, cells/s."""
        out = np.zeros(points.shape)
        if self.speed is not None:
            inside = self.holds(points)
            out[inside] = sample_field(self.speed, points[inside] - self.start)
        return out

    def holds(self, points: np.ndarray) -> np.ndarray:
        """Return which points lie among the cells' centres, bool ``(n,)``."""
        low, high = self.start + 0.5, self.start + np.array(self.level.shape[1:]) - 0.5
        return np.asarray(((points >= low) & (points <= high)).all(axis=1))


@dataclass(frozen=True)
class Together:
    """Several solids as one."""

    parts: tuple[Solid, ...]

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return the distance ``(n,)`` to the nearest."""
        return np.minimum.reduce([part.distance(points) for part in self.parts])

    def velocity(self, points: np.ndarray) -> np.ndarray:
        """Return the velocity ``(n, 3)`` of the nearest."""
        nearest = np.argmin([part.distance(points) for part in self.parts], axis=0)
        out = np.zeros(points.shape)
        for number, part in enumerate(self.parts):
            out[nearest == number] = part.velocity(points[nearest == number])
        return out


class PosedObstacle:
    """An obstacle in a domain, at any time between its poses.

    Holes are closed and doubled vertices merged as they are in the first pose.
    """

    def __init__(self, obstacle: MovingObstacle, domain: Domain, frame_seconds: float) -> None:
        """Take an obstacle; ObstacleError for one that cannot be used."""
        poses = np.asarray(obstacle.poses)
        if poses.ndim != 3 or not np.isfinite(poses).all():
            raise ObstacleError(
                f"Obstacle {obstacle.name!r} has vertices with invalid coordinates: repair it"
            )
        first = poses[0].astype(np.float64)
        checked = obstacle_from_mesh(first, obstacle.faces, obstacle.name, obstacle.kind)
        self.is_solid, self.warning = checked.solid, checked.warning
        self._kept, place = weld(first)
        self._faces = welded_faces(np.asarray(obstacle.faces), place)
        self._holes = hole_edges(self._faces, len(self._kept)) if self.is_solid else None
        self._poses, self._domain, self._frame_seconds = poses, domain, frame_seconds
        self._last: tuple[float, Voxels] | None = None

    @property
    def moves(self) -> bool:
        """Whether any vertex is elsewhere in another pose."""
        return bool((self._poses != self._poses[:1]).any())

    def corners(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the triangles at ``time``, cells, and their corners' velocities, cells/s.

        Both float64 ``(m, 3, 3)``: triangle, corner, axis.
        """
        at = min(max(time / self._frame_seconds, 0.0), len(self._poses) - 1.0)
        index = min(int(at), max(len(self._poses) - 2, 0))
        after = min(index + 1, len(self._poses) - 1)
        here, there = (self._domain.to_cells(self._poses[n][self._kept]) for n in (index, after))
        # What has come to its last pose rests.
        is_over = time > (len(self._poses) - 1) * self._frame_seconds + 1e-9
        speed = (there - here) * (0.0 if is_over else 1 / self._frame_seconds)
        return self._spanned(here + (at - index) * (there - here)), self._spanned(speed)

    def _spanned(self, vertices: np.ndarray) -> np.ndarray:
        parts = [vertices[self._faces]]
        if self._holes is not None:
            parts.append(spanned(vertices, *self._holes))
        return np.concatenate(parts)

    def at(self, time: float) -> Voxels:
        """Return it at ``time``, seconds."""
        if not self.moves:
            time = 0.0
        last = self._last  # two threads may ask at once, for different times
        if last is None or last[0] != time:
            triangles, speeds = self.corners(time)
            last = time, voxels(triangles, speeds, self.is_solid, self._domain.cells)
            self._last = last
        return last[1]

    def fastest(self, begin: float, end: float) -> float:
        """Return the greatest speed of a vertex between two moments, cells/s."""
        first = min(int(begin / self._frame_seconds + 1e-9), len(self._poses) - 1)
        last = min(int(np.ceil(end / self._frame_seconds - 1e-9)), len(self._poses) - 1)
        steps = np.diff(self._poses[first : last + 1].astype(np.float64), axis=0)
        if not steps.size:
            return 0.0
        length = np.sqrt((steps**2).sum(axis=2).max())
        return float(length) / self._domain.cell / self._frame_seconds


def voxels(triangles: np.ndarray, speeds: np.ndarray, is_solid: bool, cells: int) -> Voxels:
    """Return a mesh on the cells around it.

    triangles, speeds : ``(m, 3, 3)``, cells and cells/s; cells : along each side of the domain
    """
    corners = triangles.reshape(-1, 3)
    low = np.clip(np.floor(corners.min(axis=0) - WALL_BAND - 1), 0, cells - 2).astype(np.int64)
    high = np.clip(np.ceil(corners.max(axis=0) + WALL_BAND + 1), low + 2, cells).astype(np.int64)
    x, y, z = (int(n) for n in high - low)
    placed = triangles - low - 0.5  # cells' centres at whole numbers
    distance, owner = owned_distance(placed, (x, y, z), WALL_BAND)
    if is_solid:
        inside = winding_on_grid(placed, (x, y, z)) != 0
        level = np.where(inside, -distance, distance)
    else:
        level = distance - np.float32(SHELL_CELLS)
    speed = None
    if speeds.any():
        speed = np.zeros((3, x, y, z), dtype=np.float32)
        _surface_speed(placed, speeds, owner, speed)
    return Voxels(level[None], speed, low)


@njit(cache=True)
def _surface_speed(triangles, speeds, owner, out):
    """Write the velocity of the nearest point of the surface into ``out`` ``(3, X, Y, Z)``."""
    nx, ny, nz = owner.shape
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                m = owner[i, j, k]
                if m < 0:
                    continue
                t = triangles[m]
                x, y, z = closest_on_triangle(float(i), float(j), float(k), t)
                a, b, c = _shares(x, y, z, t)
                for axis in range(3):
                    out[axis, i, j, k] = (
                        a * speeds[m, 0, axis] + b * speeds[m, 1, axis] + c * speeds[m, 2, axis]
                    )


@njit(cache=True)
def _shares(x, y, z, t):
    """Return the barycentric coordinates of a point of triangle ``t`` (Ericson 2005, 3.4)."""
    ux, uy, uz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    vx, vy, vz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    wx, wy, wz = x - t[0, 0], y - t[0, 1], z - t[0, 2]
    uu, uv, vv = (
        ux * ux + uy * uy + uz * uz,
        ux * vx + uy * vy + uz * vz,
        vx * vx + vy * vy + vz * vz,
    )
    wu, wv = wx * ux + wy * uy + wz * uz, wx * vx + wy * vy + wz * vz
    size = uu * vv - uv * uv
    if size <= 0:
        return 1.0, 0.0, 0.0
    b, c = (vv * wu - uv * wv) / size, (uu * wv - uv * wu) / size
    return 1.0 - b - c, b, c


class MovingWalls:
    """Solids of which some move."""

    def __init__(self, still: Sequence[Solid], moving: Sequence[PosedObstacle]) -> None:
        """Take what rests and what moves."""
        self._still, self._moving = tuple(still), tuple(moving)

    def at(self, time: float) -> Solid:
        """Return all of them at ``time``, seconds."""
        return Together((*self._still, *(one.at(time) for one in self._moving)))

    def fastest(self, begin: float, end: float) -> float:
        """Return the greatest speed of a vertex between two moments, cells/s."""
        return max(one.fastest(begin, end) for one in self._moving)


def walls(ground: Solid | None, obstacles: Sequence[PosedObstacle]) -> Solid | MovingSolid:
    """Return all that the liquid keeps out of as one."""
    still: list[Solid] = [] if ground is None else [ground]
    still += [one.at(0.0) for one in obstacles if not one.moves]
    moving = [one for one in obstacles if one.moves]
    if moving:
        return MovingWalls(still, moving)
    if len(still) == 1:
        return still[0]
    return Together(tuple(still)) if still else Nothing()
