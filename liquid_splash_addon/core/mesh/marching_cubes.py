# SPDX-License-Identifier: GPL-3.0-or-later
"""The liquid's surface as a triangle mesh with a velocity at every vertex."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..grid import Grid
from ..liquid.fields import AIR, NEAREST, Fields

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

TAUBIN = (0.5, -0.53)
"""Taubin's lambda and mu: the pass band ends at 1 / 0.5 - 1 / 0.53, about 0.11."""

SMOOTHING_STEPS = 12

LEVEL_SPREAD = 0.5
"""Width in cells of the Gaussian that joins the generator's 2^3 patches before meshing."""

FARTHEST = 40.0
"""Most that a level may be shifted so as to keep a volume."""

LEVEL_BAND = 1.5
"""Distances beyond this many cells do not count there, so that sheets do not thin out."""


SURE = 1e-4
"""Probability, of liquid or of air, that no cell is under: logarithms stay finite."""


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh, watertight, normals outward.

    Attributes
    ----------
    vertices : float32 ``(n, 3)``
    faces : int32 ``(m, 3)``
    velocities : float32 ``(n, 3)``, in the unit of the vertices per second
    """

    vertices: np.ndarray
    faces: np.ndarray
    velocities: np.ndarray

    @classmethod
    def empty(cls) -> Mesh:
        """Return a mesh without faces."""
        nothing = np.zeros((0, 3), dtype=np.float32)
        return cls(nothing, np.zeros((0, 3), dtype=np.int32), nothing)

    def joined(self, other: Mesh) -> Mesh:
        """Return both meshes as one."""
        return Mesh(
            np.concatenate([self.vertices, other.vertices]),
            np.concatenate([self.faces, other.faces + np.int32(len(self.vertices))]),
            np.concatenate([self.velocities, other.velocities]),
        )


def surface(fields: Fields, threshold: float = 0.5) -> Mesh:
    """Return the surface of the liquid in local metres, by marching cubes (Lewiner).

    threshold : probability of liquid at the surface; 0.5 is the calibrated one. Fields are
    padded by a cell of air first, so that the mesh is closed where liquid meets the box. A
    splash with no liquid gives an empty mesh.
    """
    return level_surface(surface_level(fields, threshold), fields.velocity, fields.grid)


def level_surface(level: np.ndarray, velocity: np.ndarray, grid: Grid) -> Mesh:
    """Return the zero of ``level`` ``(X, Y, Z)``, see :func:`surface_level`, in metres.

    It holds as much liquid as there are cells below zero, within 5 % where sheets are a few
    cells thick, 15 % where they are one.

    velocity : ``(3, X, Y, Z)``, m/s.
    """
    from scipy.ndimage import gaussian_filter

    box = liquid_box(level)
    if box is None:
        return Mesh.empty()
    bounded = np.pad(np.clip(level[box], -LEVEL_BAND, LEVEL_BAND), 1, constant_values=LEVEL_BAND)
    padded = gaussian_filter(bounded, LEVEL_SPREAD, mode="nearest")
    padded[[0, -1]] = padded[:, [0, -1]] = padded[:, :, [0, -1]] = LEVEL_BAND
    iso = level_of_volume(bounded, padded)
    if padded.min() >= iso:
        return Mesh.empty()
    vertices, faces = marched(padded, iso)
    # Vertex coordinates are array indices: cell centres, one cell padded on.
    cells = smooth(vertices, faces) - 0.5 + [side.start for side in box]
    velocities = sample_field(velocity, cells)
    points = grid.to_metres(cells).astype(np.float32)
    return Mesh(points, faces.astype(np.int32), velocities)


def marched(level: np.ndarray, iso: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices ``(n, 3)`` and faces ``(m, 3)`` where ``level`` is ``iso``, a manifold.

    In sheets thinner than a cell, marching cubes may join four faces in an edge. Nearer to zero
    there is less of them; zero, where the sheets are torn, has the last word.
    """
    from skimage.measure import marching_cubes

    while True:
        # "descent" because the liquid lies below the level: normals then point outward.
        vertices, faces, _, _ = marching_cubes(level, iso, gradient_direction="descent")
        if edge_counts(faces, len(vertices)).data.max() == 1 or iso == 0 or level.min() >= 0:
            return vertices, faces
        iso = iso / 2 if abs(iso) > 0.05 else 0.0


def level_of_volume(level: np.ndarray, blurred: np.ndarray) -> float:
    """Return the value of ``blurred`` below which there is as much as below zero of ``level``.

    A blurred sheet or drop loses liquid to the air around it; taken at this value, not at zero,
    it keeps what it had. A cell is full half a cell below the surface and empty half a cell above.
    """
    from scipy.optimize import brentq

    volume = filled(level[level < 0.5])
    near = blurred[blurred < LEVEL_BAND]
    return float(
        brentq(lambda iso: filled(near - iso) - volume, -LEVEL_BAND, LEVEL_BAND, xtol=1e-4)
    )


def filled(level: np.ndarray) -> float:
    """Return the volume in cells of those of ``level``; one the surface cuts counts in part."""
    return float(np.clip(0.5 - level, 0.0, 1.0).sum(dtype=np.float64))


def balanced(shifted: Callable[[float], np.ndarray], volume: float) -> np.ndarray:
    """Return ``shifted(more)``, a level, for the number that gives it ``volume``, in cells.

    The greater the number, the less liquid. ``shifted(0)`` if none up to FARTHEST does: then it
    is hardly shifted by any.
    """
    from scipy.optimize import brentq

    def surplus(more: float) -> float:
        return filled(shifted(more)) - volume

    if surplus(-FARTHEST) <= 0 or surplus(FARTHEST) >= 0:
        return shifted(0.0)
    return shifted(brentq(surplus, -FARTHEST, FARTHEST, xtol=1e-3))


def smooth(
    vertices: np.ndarray, faces: np.ndarray, iterations: int = SMOOTHING_STEPS
) -> np.ndarray:
    """Return vertices ``(n, 3)`` without the voxels' staircase (Taubin 1995).

    Each iteration moves vertices towards their neighbours' mean and then a little further
    back: steps of a cell vanish while volume, and so thin sheets and small drops, stay. Where
    faces would cross, they stay nearer to where they were.

    faces : int ``(m, 3)``; none cross.
    """
    from .self_intersection import take_back

    mean = neighbour_mean(faces, len(vertices))
    moved = vertices.astype(np.float64)
    for _ in range(iterations):
        for factor in TAUBIN:
            moved = moved + factor * (mean @ moved - moved)
    return take_back(vertices.astype(np.float64), moved, faces)


def neighbour_mean(faces: np.ndarray, count: int) -> csr_matrix:
    """Return the matrix that gives each vertex the mean of its neighbours, ``(count, count)``."""
    from scipy.sparse import diags

    links = edge_counts(faces, count)
    return diags(1 / np.maximum(np.asarray(links.sum(axis=1)).ravel(), 1)) @ links


def edge_counts(faces: np.ndarray, count: int) -> csr_matrix:
    """Return how many faces run along each edge in each direction, ``(count, count)``.

    Once wherever a closed mesh is a manifold.
    """
    from scipy.sparse import coo_matrix

    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).T
    return coo_matrix((np.ones(ends.shape[1]), ends), shape=(count, count)).tocsr()


def surface_level(fields: Fields, threshold: float) -> np.ndarray:
    """Return the field whose zero level is the surface, in cells, float32 ``(X, Y, Z)``.

    It is the difference of the logits of ``threshold`` and occupancy, taken as one cell for a
    factor e^2 of the odds: continuous in the threshold, negative exactly where occupancy is
    above it. The distance alone would lose sheets that the generator is not sure of.
    """
    surface_logit = np.log(threshold / (1 - threshold))
    air = np.log(SURE / (1 - SURE))
    level = np.full(fields.occupancy.shape, (surface_logit - air) / 2, dtype=np.float32)
    near = np.flatnonzero(fields.occupancy > SURE)  # a few cells in a hundred
    odds = np.minimum(fields.occupancy.ravel()[near], 1 - SURE)
    level.ravel()[near] = (surface_logit - np.log(odds / (1 - odds))) / 2
    return level


def probability(level: np.ndarray) -> np.ndarray:
    """Return the occupancy, float32, of which ``level`` is the :func:`surface_level`."""
    from scipy.special import expit

    return np.asarray(expit(-2 * level), dtype=np.float32)


def set_level(
    fields: Fields, where: tuple[np.ndarray, ...], level: np.ndarray, distance: np.ndarray
) -> None:
    """Set the liquid at cells to that of ``level`` ``(n,)``, in place.

    distance : theirs, cells ``(n,)``; where its sign is not the liquid's, it becomes NEAREST.
    """
    fields.occupancy[where] = probability(level)
    sign = np.where(fields.occupancy[where] > 0.5, -1, 1)
    fields.distance[where] = sign * np.clip(sign * distance, NEAREST, AIR)


def liquid_box(level: np.ndarray, margin: int = 4) -> tuple[slice, slice, slice] | None:
    """Return the part of a grid that holds liquid, ``margin`` cells wider; None without liquid."""
    inside = level < 0
    columns, plane = inside.any(axis=2), inside.any(axis=0)
    parts = []
    for rows in (columns.any(axis=1), columns.any(axis=0), plane.any(axis=0)):
        wet = np.flatnonzero(rows)
        if not len(wet):
            return None
        parts.append(slice(max(int(wet[0]) - margin, 0), int(wet[-1]) + 1 + margin))
    return (parts[0], parts[1], parts[2])


def sample_field(field: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return ``field`` ``(C, X, Y, Z)`` at cell coordinates ``(n, 3)``, trilinearly, ``(n, C)``."""
    from scipy.ndimage import map_coordinates

    where = (cells - 0.5).T
    columns = [map_coordinates(part, where, order=1, mode="nearest") for part in field]
    return np.stack(columns, axis=1).astype(np.float32)
