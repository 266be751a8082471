# SPDX-License-Identifier: GPL-3.0-or-later
"""Obstacles: meshes that the liquid keeps out of."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..grid import Grid
from ..liquid.level_set import LevelSet
from ..liquid.smooth_csg import smooth_maximum
from ..mesh.closest_point import nearest_on_mesh
from ..mesh.hole_filling import films, welded
from ..mesh.signed_distance import bounds_of, distance_on_grid, relevant, winding_on_grid
from ..numeric.triangles import triangle_areas
from ..sketch.local_frame import Frame

HOLES = 0.15
"""Share of a mesh's area up to which its holes are closed as if by a film: a figure without a
bottom is solid. A plane (1), a bowl (0.5) or an open tube is not."""

SHELL = 1.0
"""Half the thickness in cells given to such a mesh, so that the grid can hold it."""

BAND = 4.0
"""Distances are known up to this many cells beyond the offset."""

CLOSE = 0.025
"""Metres up to which the generator takes notice of an obstacle (condition.closeness)."""

CONTACT = (1.0, 3.0)
"""Cells from the obstacle up to which velocity is tangential, and from which it is as it was."""


SWALLOWED = (
    "The obstacles swallow the whole splash: move them out of it, make them smaller "
    "or lower the offset"
)


RIM = 2.0
"""Width in cells of the round edge between the liquid's surface and the obstacle: half of it is
the least thickness of liquid beside an obstacle."""


class ObstacleError(ValueError):
    """An obstacle cannot be used; the message says what to do."""


@dataclass(frozen=True)
class Obstacle:
    """A mesh that liquid keeps out of.

    Attributes
    ----------
    triangles : float64 ``(m, 3, 3)``: triangle, corner, axis; holes closed; metres, or the unit
        of the grid it is used with
    solid : False for an open surface, which counts as a sheet SHELL cells thick on either side
    warning : a sentence for the user, or nothing
    """

    triangles: np.ndarray
    solid: bool = True
    warning: str = ""

    def near(self, low: np.ndarray, high: np.ndarray) -> Obstacle:
        """Return what decides about the distance in a box: the triangles in it and below it.

        low, high : ``(3,)``, corners of the box, in the unit of the triangles.
        """
        return replace(self, triangles=self.triangles[relevant(*self.bounds, low, high)])

    def seen_from(self, frame: Frame) -> Obstacle:
        """Return an obstacle in drawing units as one in the local metres of a frame."""
        return replace(self, triangles=frame.points_to_local(self.triangles))

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest coordinates of each triangle, ``(m, 3)`` each."""
        return bounds_of(self.triangles)


@dataclass(frozen=True)
class Clearance:
    """How far it is to the nearest obstacle.

    Attributes
    ----------
    distance : float32 ``(X, Y, Z)``, cells, negative inside, at most +-``band``
    band : cells
    grid : where the cells lie
    """

    distance: np.ndarray
    band: float
    grid: Grid


def obstacle_from_mesh(vertices: np.ndarray, faces: np.ndarray, name: str = "") -> Obstacle:
    """Return the obstacle that a mesh stands for.

    vertices : ``(n, 3)``; faces : ``(m, 3)`` indices. Parts may overlap, and the normals may all
    point inward. Small holes (see HOLES) are closed; a mesh with larger ones becomes a sheet,
    with a warning. Raises ObstacleError, naming the mesh, if it is none.
    """
    label = f"Obstacle {name!r}" if name else "The obstacle"
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    if not len(faces):
        raise ObstacleError(f"{label} has no faces: choose a mesh with faces or remove it")
    if not np.isfinite(vertices).all():
        raise ObstacleError(f"{label} has vertices that are no numbers: delete or repair them")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ObstacleError(f"{label} has faces without vertices: validate the mesh")
    vertices, faces = welded(vertices, faces)
    triangles = vertices[faces]
    caps = films(vertices, faces)
    size = triangle_areas(triangles).sum()
    if not size > 0:
        raise ObstacleError(f"{label} has no area: choose a mesh with faces or remove it")
    share = triangle_areas(caps).sum() / size
    if share <= HOLES:
        return Obstacle(np.concatenate([triangles, caps]))
    return Obstacle(
        triangles,
        False,
        f"{label} is not closed (holes of {share:.0%} of its area): it counts as a thin sheet. "
        "For a solid one fill its holes and recalculate its normals, or add a Solidify modifier",
    )


def digest(obstacles: Sequence[Obstacle]) -> str:
    """Return what tells these obstacles from any others."""
    found = hashlib.sha256()
    for obstacle in obstacles:
        found.update(obstacle.triangles.tobytes())
    return found.hexdigest()[:16]


def signed_distance(obstacle: Obstacle, grid: Grid, band: float = BAND) -> np.ndarray:
    """Return the distance to an obstacle at cell centres, float32 ``(X, Y, Z)``.

    In cells, negative inside, at most +-``band``; exact up to 2 cells, to a tenth of a cell
    beyond.
    """
    triangles = in_cells(obstacle.triangles, grid)
    if not obstacle.solid:
        distance = distance_on_grid(triangles, grid.shape, band + SHELL)
        return distance - np.float32(SHELL)
    distance = distance_on_grid(triangles, grid.shape, band)
    inside = winding_on_grid(triangles, grid.shape) != 0
    return np.where(inside, -distance, distance)


def in_cells(points: np.ndarray, grid: Grid) -> np.ndarray:
    """Map points ``(..., 3)`` to cells, cell centres at whole numbers."""
    return np.asarray(grid.to_cells(points) - 0.5)


def clearance(obstacles: Sequence[Obstacle], grid: Grid, band: float = BAND) -> Clearance:
    """Return the distance to the nearest of several obstacles; ``band`` where there is none."""
    distance = np.full(grid.shape, band, dtype=np.float32)
    for obstacle in obstacles:
        np.minimum(distance, signed_distance(obstacle, grid, band), out=distance)
    return Clearance(distance, band, grid)


def generator_obstacle(obstacles: Sequence[Obstacle], grid: Grid) -> np.ndarray | None:
    """Return ``Generator.generate``'s obstacle on ``grid`` (local metres); None without any.

    It is the signed distance in cells, ``(X, Y, Z)``, up to the 25 mm that ``condition.closeness``
    tells apart.
    """
    if not obstacles:
        return None
    return clearance(obstacles, grid, CLOSE / grid.spacing).distance


def carve(liquid: LevelSet, obstacles: Sequence[Obstacle], offset: float = 0.0) -> LevelSet:
    """Return the liquid outside the obstacles, with velocity along them.

    obstacles : in the unit of the liquid's grid. offset : cells of air left around them, 0 or more.
    Raises ObstacleError if no liquid is left.
    """
    if not obstacles:
        return liquid
    near = clearance(obstacles, liquid.grid, BAND + offset)
    carved = replace(
        liquid,
        level=carved_level(liquid.level, near, offset),
        velocity=tangential(liquid.velocity, near, offset),
    )
    if (liquid.level < 0).any() and not (carved.level < 0).any():
        raise ObstacleError(SWALLOWED)
    return carved


def carved_level(level: np.ndarray, near: Clearance, offset: float) -> np.ndarray:
    """Return the level without what is nearer than ``offset`` cells to an obstacle.

    A smooth maximum: where liquid runs out in a wedge along an obstacle, it ends in a rim that
    the grid can hold. The sharp maximum leaves teeth there.
    """
    carved = smooth_maximum(level, np.float32(offset) - near.distance, RIM)
    return np.where(near.distance < near.band, carved, level)


def tangential(velocity: np.ndarray, near: Clearance, offset: float) -> np.ndarray:
    """Return the velocity ``(3, X, Y, Z)`` without the part that runs into the obstacles.

    All of that part is taken away up to ``offset`` + CONTACT[0] cells from them, none from
    ``offset`` + CONTACT[1].
    """
    full, none = offset + CONTACT[0], offset + CONTACT[1]
    touched = (near.distance < none) & (near.distance > -near.band)
    if not touched.any():
        return velocity
    normal = slope(near.distance, np.nonzero(touched))
    share = np.clip((none - near.distance[touched]) / (none - full), 0.0, 1.0)
    moving = velocity[:, touched]
    into = np.minimum((moving * normal).sum(axis=0), 0.0)
    result = velocity.copy()
    result[:, touched] = moving - share * into * normal
    return result


def slope(field: np.ndarray, index: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return the unit gradient ``(3, n)`` of a field at some of its cells, by central differences.

    index : of the n cells, one array for each axis.
    """
    parts = []
    for axis in range(3):
        up, down = list(index), list(index)
        up[axis] = np.minimum(index[axis] + 1, field.shape[axis] - 1)
        down[axis] = np.maximum(index[axis] - 1, 0)
        parts.append((field[tuple(up)] - field[tuple(down)]) / (up[axis] - down[axis]))
    gradient = np.stack(parts)
    return gradient / np.maximum(np.linalg.norm(gradient, axis=0), np.float32(1e-9))


def depth_of_points(
    obstacle: Obstacle, points: np.ndarray, cell: float, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the signed distance ``(n,)`` in cells and the nearest point ``(n, 3)`` of points.

    points : ``(n, 3)`` in the obstacle's unit, of which ``cell`` make a cell. Exact within
    ``reach`` cells of its surface; farther points get +-``reach`` and themselves.
    """
    scaled = np.asarray(points, dtype=np.float64) / cell
    low = obstacle.bounds[0].min(axis=0) / cell - reach - SHELL
    high = obstacle.bounds[1].max(axis=0) / cell + reach + SHELL
    near = ((scaled > low) & (scaled < high)).all(axis=1)
    distance, nearest = np.full(len(scaled), float(reach)), scaled.copy()
    extent = reach if obstacle.solid else reach + SHELL
    found, where, winding = nearest_on_mesh(obstacle.triangles / cell, scaled[near], extent)
    if obstacle.solid:
        found = np.where(winding != 0, -found, found)
    else:
        found = found - SHELL
    distance[near], nearest[near] = found, where
    return distance, nearest * cell
