# SPDX-License-Identifier: GPL-3.0-or-later
"""Small drops of a splash that moves, each the same drop in every frame.

Those that the solver's cells cannot hold fly from the start. Others go on breaking off: droplets
chosen anew for every frame would flicker. Here each is born once, where eq. 4 of the paper
holds, grows while it leaves the surface, then flies freely until it meets the liquid again.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..composition.drops import Drops
from ..mesh.closest_point import nearest_on_mesh
from ..mesh.laplacian import laplacian, mean_curvature
from ..mesh.mesh import Mesh
from ..numeric.triangles import vertex_normals
from ..refinement.droplets import SAMPLE_DISTANCE, SPEED_SPREAD
from ..refinement.front import DISTANCE_BLUR, LEAST_MEASURE, strongest
from ..refinement.settings import LARGEST_RADIUS, SMALLEST_RADIUS, DropletSettings

LEAST_SOLVED = 1.75
"""Radius in cells of the smallest drop that is left to the solver: its surface shows one of 1.3
cells half as large, one of 1 cell as a speck."""

SMALLEST_BORN = 0.3
"""Radius of the smallest drop over the mean, as in droplets of a splash at rest."""


class Surroundings(NamedTuple):
    """What drops fall through and onto, local metres.

    Attributes
    ----------
    gravity : float64 ``(3,)``, m/s^2
    up : float64 ``(3,)``, unit vector
    ground : height along ``up`` below which there is nothing; -inf for none
    """

    gravity: np.ndarray
    up: np.ndarray
    ground: float = -np.inf


class FlyingDrops(NamedTuple):
    """Drops in flight, local metres and m/s.

    Attributes
    ----------
    positions, velocities : float32 ``(n, 3)``
    radii : float32 ``(n,)``, when they are grown
    ages, growths : float32 ``(n,)``, seconds since they were born, and in which they grow
    """

    positions: np.ndarray
    velocities: np.ndarray
    radii: np.ndarray
    ages: np.ndarray
    growths: np.ndarray

    @classmethod
    def none(cls) -> FlyingDrops:
        """Return no drops."""
        nothing = np.zeros((0, 3), dtype=np.float32)
        return cls(nothing, nothing, *(np.zeros(0, dtype=np.float32) for _ in range(3)))

    @classmethod
    def grown(cls, positions: np.ndarray, velocities: np.ndarray, radii: np.ndarray) -> FlyingDrops:
        """Return drops that are there from the start."""
        return cls(positions, velocities, radii, *np.zeros((2, len(radii)), dtype=np.float32))

    def joined(self, others: Sequence[FlyingDrops]) -> FlyingDrops:
        """Return these drops and others."""
        return FlyingDrops(*map(np.concatenate, zip(self, *others, strict=True)))

    def only(self, kept: np.ndarray) -> FlyingDrops:
        """Return the drops for which ``kept``, bool ``(n,)``, is true."""
        return FlyingDrops(*(values[kept] for values in self))

    def later(self, seconds: float, gravity: np.ndarray) -> FlyingDrops:
        """Return them after free fall: p + v t + g t^2 / 2."""
        velocities = self.velocities + np.float32(seconds) * gravity.astype(np.float32)
        mean = (self.velocities + velocities) / 2
        return self._replace(
            positions=self.positions + np.float32(seconds) * mean,
            velocities=velocities,
            ages=self.ages + np.float32(seconds),
        )

    def shown(self) -> Drops:
        """Return them as large as they are now, none in a mesh as yet."""
        share = self.ages / np.maximum(self.growths, 1e-9)
        grown = np.where(self.growths > 0, np.clip(share, 0, 1), 1).astype(np.float32)
        none = np.zeros(len(self.radii), dtype=bool)
        return Drops(self.positions, self.velocities, self.radii * np.cbrt(grown), none)


def advance(
    drops: FlyingDrops,
    mesh: Mesh,
    steps: Sequence[DropletSettings],
    seconds: float,
    number: int,
    cell: float,
    around: Surroundings,
    solids: Sequence[np.ndarray] = (),
) -> FlyingDrops:
    """Return the drops of the next frame: those that fly on, and those born meanwhile.

    mesh : the liquid of that frame; seconds : since the last one; number : of the frame, which
    with the seed picks where drops are born; cell : of the simulation, metres. A step of
    droplets makes as many in its *Flight* as it would for the liquid at rest.
    solids : triangles ``(m, 3, 3)`` of what stands in the way.
    """
    flown = drops.later(seconds, around.gravity)
    flown = flown.only(flown.positions @ around.up > around.ground)
    for triangles in (mesh.vertices[mesh.faces], *solids):
        flown = flown.only(~inside(triangles, flown.positions, 2 * LARGEST_RADIUS * cell))
    return flown.joined([born(mesh, step, seconds, number, cell) for step in steps])


def inside(triangles: np.ndarray, points: np.ndarray, reach: float) -> np.ndarray:
    """Return which points ``(n, 3)`` are in a closed surface, bool ``(n,)``.

    triangles : ``(m, 3, 3)``; reach : size of the bins into which points are sorted, metres
    """
    if not len(points) or not len(triangles):
        return np.zeros(len(points), dtype=bool)
    _, _, winding = nearest_on_mesh(triangles.astype(np.float64), points.astype(np.float64), reach)
    return np.asarray(winding != 0)


def born(
    mesh: Mesh, settings: DropletSettings, seconds: float, number: int, cell: float
) -> FlyingDrops:
    """Return the drops that break off ``mesh`` in ``seconds``, touching it from outside."""
    if not len(mesh.faces) or settings.amount == 0:
        return FlyingDrops.none()
    rng = np.random.default_rng((settings.seed, number))
    normals = vertex_normals(mesh.vertices, mesh.faces)
    cells = np.floor(mesh.vertices / cell).astype(np.int64)
    apart = SAMPLE_DISTANCE * max(settings.size, SMALLEST_RADIUS)
    measure = break_measure(mesh, normals, settings, cell)
    chosen = strongest(cells, measure, settings.amount, apart, rng)
    chosen = chosen[rng.random(len(chosen)) < seconds / settings.flight]
    count = len(chosen)
    radii = settings.size * np.exp(settings.spread * rng.normal(size=count))
    radii = np.clip(radii, SMALLEST_BORN * settings.size, LARGEST_RADIUS) * cell
    pace = 1 + SPEED_SPREAD * np.abs(np.clip(rng.normal(size=count), -2, 2))
    positions = mesh.vertices[chosen] + radii[:, None] * normals[chosen]
    return FlyingDrops(
        positions.astype(np.float32),
        (mesh.velocities[chosen] * pace[:, None]).astype(np.float32),
        radii.astype(np.float32),
        np.zeros(count, dtype=np.float32),
        np.full(count, settings.flight, dtype=np.float32),
    )


def break_measure(
    mesh: Mesh, normals: np.ndarray, settings: DropletSettings, cell: float
) -> np.ndarray:
    """Return the logarithm of the left side of eq. 4 at the vertices, float32 ``(n,)``.

    As :func:`core.refinement.front.break_measure` does in cells, with the mesh's own Laplacian.
    """
    operator = laplacian(mesh.vertices, mesh.faces, cell)
    turbulence = np.sqrt(sum(operator.apply(axis) ** 2 for axis in mesh.velocities.T)) * cell
    curvature = 2 * mean_curvature(operator, mesh.vertices, normals)
    curvature = np.abs(operator.diffuse(curvature, DISTANCE_BLUR * cell)) * cell
    return np.asarray(
        settings.turbulence * np.log(np.maximum(turbulence, LEAST_MEASURE))
        + settings.curvature * np.log(np.maximum(curvature, LEAST_MEASURE))
    )
