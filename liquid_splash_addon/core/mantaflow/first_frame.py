# SPDX-License-Identifier: GPL-3.0-or-later
"""The splash on a domain's grid, as Mantaflow knows liquid: level, face velocities, particles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..animation.projection import project_faces
from ..animation.solver_start import SolverStart
from ..fluid.surface import redistance
from ..numeric.trilinear import sample_field
from ..progress import Report, silent
from .domain import LEAST_ROOM, TIME_UNIT, WALL, Domain, DomainError
from .settings import MantaflowSettings

SAMPLES = 2
"""Particles along each edge of a cell: Mantaflow's default."""

JITTER = 0.1
"""Largest displacement of a particle, cells."""

BAND = 3.0
"""Cells below the surface in which there are particles: deeper ones Mantaflow deletes."""

SURE = 1.5
"""Cells from the surface from which the level at its centre tells of the whole of a cell."""

DEEP = 7.0
"""Largest depth, in cells, that the level tells apart."""

REACH = 4.0
"""Cells outside the surface in which the velocity is known."""


@dataclass(frozen=True)
class FirstFrame:
    """A splash in a domain; lengths in cells of it, velocities in cells per unit of its time.

    Attributes
    ----------
    domain : where the cells lie
    level : float32 ``(X, Y, Z)``, signed distance, negative in the liquid
    faces : float32 ``(3, X, Y, Z)``, on the lower faces
    positions, velocities : float32 ``(n, 3)``, the particles
    removed : relative L2 norm of the part of the velocity inside thick liquid that diverges: it is
        removed by the first pressure solve, or was before writing
    volume : of the splash above the ground, cells^3
    """

    domain: Domain
    level: np.ndarray
    faces: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    removed: float
    volume: float

    @property
    def fastest(self) -> float:
        """Speed of the fastest particle, cells per unit of time."""
        if not len(self.velocities):
            return 0.0
        return float(np.linalg.norm(self.velocities, axis=1).max())


class Walls:
    """The walls of a domain as a solid: its bottom, and its sides where they are closed."""

    def __init__(self, shape: tuple[int, int, int], ground: str) -> None:
        self.shape, self.ground = shape, ground

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Distance ``(n,)`` of points in cells from the nearest wall, negative in it."""
        away = points[:, 2] - WALL
        if self.ground == "POOL":
            sides = np.minimum(points[:, :2], np.array(self.shape)[:2] - points[:, :2]) - WALL
            away = np.minimum(away, sides.min(axis=1))
        return np.asarray(away, dtype=np.float64)

    def velocity(self, points: np.ndarray) -> np.ndarray:
        """Walls are at rest: ``(n, 3)`` zeros."""
        return np.zeros_like(points)


def first_frame(
    start: SolverStart,
    domain: Domain,
    settings: MantaflowSettings,
    seed: int = 0,
    report: Report = silent,
) -> FirstFrame:
    """Return a splash on the grid of a domain.

    Raises DomainError if the domain is too small for the liquid or its cells are too large, and
    what ``report`` raises.
    """
    report("Placing liquid", 0.0)
    sampler = Sampler(start, domain, settings)
    level = sampler.level()
    check_room(level, settings.ground)
    report("Placing particles", 0.3)
    seeds = seeded(level, sampler, np.random.default_rng(seed))
    if not len(seeds):
        raise DomainError("The liquid is thinner than the domain's voxels: raise Resolution")
    report("Reading velocity", 0.5)
    faces = sampler.faces(level)
    report("Projecting velocity", 0.6)
    walls = None if settings.ground == "NONE" else Walls(domain.shape, settings.ground)
    free, removed = project_faces(level, faces, walls)
    if settings.divergence_free:
        faces = free
    velocities = at_points(faces, seeds)
    report("Placing particles", 0.9)
    volume = len(seeds) / SAMPLES**3 + float((level <= -BAND - SURE).sum())
    shallow = sample_field(level[None], seeds)[:, 0] > -BAND
    return FirstFrame(
        domain, level, faces, seeds[shallow].astype(np.float32), velocities[shallow], removed,
        volume,
    )  # fmt: skip


class Sampler:
    """The liquid of a start at points of a domain, all in its cells."""

    def __init__(self, start: SolverStart, domain: Domain, settings: MantaflowSettings) -> None:
        self.start, self.domain, self.settings = start, domain, settings
        world = start.world
        self.ratio = start.cell / domain.cell
        self.surface = start.liquid.distance
        # Velocities of the liquid's own time: slow motion is Mantaflow's time scale.
        self.per_metre = TIME_UNIT / (domain.cell * world.scale.length)
        drops = start.drops
        self.centres = self.to_domain(world.points_to_drawing(drops.positions.astype(np.float64)))
        self.radii = world.scale.lengths_to_drawing(drops.radii.astype(np.float64)) / domain.cell
        self.speeds = drops.velocities.astype(np.float64) @ world.axes * self.per_metre
        x = settings.ground_height - domain.corner[2]
        self.pool = x / domain.cell if settings.ground == "POOL" else -np.inf

    def to_domain(self, points: np.ndarray) -> np.ndarray:
        """Map points ``(n, 3)`` of the world to the domain's cells."""
        return np.asarray((points - self.domain.corner) / self.domain.cell)

    def to_liquid(self, points: np.ndarray) -> np.ndarray:
        """Map points ``(n, 3)`` in the domain's cells to the liquid's."""
        world = points * self.domain.cell + self.domain.corner
        return self.start.liquid.grid.to_cells(self.start.world.points_to_local(world))

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Return the distance to the liquid at points ``(n, 3)``, drops and pool included."""
        cells = self.to_liquid(points)
        away = self.ratio * sample_field(self.surface[None], cells)[:, 0]
        # Outside its grid there is no liquid, however near a side it ends.
        shape = np.array(self.surface.shape)
        beyond = np.maximum(np.maximum(-cells, cells - shape), 0).max(axis=1) * self.ratio
        away = np.maximum(away, np.where(beyond > 0, beyond, -np.inf))
        if np.isfinite(self.pool):
            away = np.minimum(away, points[:, 2] - self.pool)
        if len(self.radii):
            away = np.minimum(away, self.to_drops(points)[0])
        return np.asarray(away)

    def to_drops(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distance of points to the nearest drop's surface, and that drop's number."""
        from scipy.spatial import cKDTree

        away, nearest = cKDTree(self.centres).query(points)
        return away - self.radii[nearest], nearest

    def level(self) -> np.ndarray:
        """Return the signed distance at the centres of the domain's cells."""
        shape = self.domain.shape
        level = np.empty(shape, dtype=np.float32)
        plane = np.indices(shape[1:]).reshape(2, -1).T + 0.5
        for i in range(shape[0]):
            points = np.column_stack([np.full(len(plane), i + 0.5), plane])
            level[i] = self.depth(points).reshape(shape[1:])
        if np.isfinite(self.pool):
            # The solver's walls hold it; the level knows of none.
            level = np.pad(level, 8, mode="edge")
            return far(level)[8:-8, 8:-8, 8:-8]
        return far(level)

    def faces(self, level: np.ndarray) -> np.ndarray:
        """Return the velocity on the lower faces of cells near the liquid, ``(3, X, Y, Z)``."""
        faces = np.zeros((3, *level.shape), dtype=np.float32)
        near = np.argwhere(level < REACH)
        for axis in range(3):
            points = near + 0.5
            points[:, axis] -= 0.5
            faces[axis, *near.T] = self.velocity(points)[:, axis]
        return faces

    def velocity(self, points: np.ndarray) -> np.ndarray:
        """Return the velocity of the liquid at points ``(n, 3)``; the pool is still."""
        liquid = self.start.liquid
        cells = self.to_liquid(points)
        local = liquid.flow_at(cells) * liquid.grid.spacing
        found = local @ self.start.world.axes * self.per_metre
        away = self.ratio * sample_field(self.surface[None], cells)[:, 0]
        if len(self.radii):
            from_drops, nearest = self.to_drops(points)
            closer = from_drops < away
            found[closer] = self.speeds[nearest[closer]]
        if np.isfinite(self.pool):
            found[(points[:, 2] < self.pool) & (away > 0)] = 0
        return np.asarray(found, dtype=np.float32)


def far(level: np.ndarray) -> np.ndarray:
    """Return a level as signed distance up to DEEP cells inside and outside."""
    padded = np.pad(np.clip(level, -DEEP, DEEP), 1, constant_values=DEEP)
    return redistance(padded.astype(np.float32), DEEP)[1:-1, 1:-1, 1:-1]


def check_room(level: np.ndarray, ground: str) -> None:
    """Raise DomainError if liquid is too near to an open side of the domain, or in a wall."""
    wet = level < 0
    wet[:, :, :WALL] = False
    if not wet.any():
        raise DomainError("The liquid is thinner than the domain's voxels: raise Resolution")
    if ground == "POOL":
        return
    room = LEAST_ROOM - 1
    sides = [wet[:room], wet[-room:], wet[:, :room], wet[:, -room:], wet[:, :, -room:]]
    if ground == "NONE":
        sides.append(wet[:, :, :room])
    if any(side.any() for side in sides):
        raise DomainError("The domain is too small for the splash: raise Margin")


def seeded(level: np.ndarray, sampler: Sampler, rng: np.random.Generator) -> np.ndarray:
    """Return places ``(n, 3)`` of particles all over the liquid near its surface, by its own shape.

    A drop smaller than the space between them still gets one, if it is half as large as what a
    particle stands for.
    """
    near = np.argwhere((level < SURE) & (level > -BAND - SURE))
    parts = [(np.array(part) + 0.5) / SAMPLES for part in np.ndindex((SAMPLES,) * 3)]
    seeds = np.concatenate([near + part for part in parts])
    seeds = seeds + rng.uniform(-JITTER, JITTER, seeds.shape)
    seeds = seeds[sampler.depth(seeds) < 0]
    if len(sampler.radii):
        seeds = np.concatenate([seeds, small_drops(sampler, seeds)])
    ends = np.array(level.shape) - WALL
    return np.asarray(seeds[((seeds > WALL) & (seeds < ends)).all(axis=1)])


def small_drops(sampler: Sampler, seeds: np.ndarray) -> np.ndarray:
    """Return the centres of drops that hold none of ``seeds``, but half a particle's volume."""
    from scipy.spatial import cKDTree

    volume = 4 / 3 * np.pi * sampler.radii**3 * SAMPLES**3
    lonely = np.ones(len(sampler.radii), dtype=bool)
    if len(seeds):
        lonely = cKDTree(seeds).query(sampler.centres)[0] > sampler.radii
    return np.asarray(sampler.centres[lonely & (volume > 0.5)])


def at_points(faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return face velocities ``(3, X, Y, Z)`` at points ``(n, 3)``, trilinearly, ``(n, 3)``."""
    found = []
    for axis in range(3):
        shifted = points.copy()
        shifted[:, axis] += 0.5  # a lower face lies where the cell's number is
        found.append(sample_field(np.ascontiguousarray(faces[axis])[None], shifted)[:, 0])
    return np.stack(found, axis=1).astype(np.float32)
