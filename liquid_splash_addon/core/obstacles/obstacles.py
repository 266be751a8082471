# SPDX-License-Identifier: GPL-3.0-or-later
"""Obstacles: their signed distance, and liquid carved by them."""

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
from ..mesh.signed_distance import bounds_of, deciding_triangles, distance_on_grid, winding_on_grid
from ..numeric.gradient import unit_gradient
from ..numeric.triangles import triangle_areas
from ..sketch.local_frame import Frame
from .openness import MEANT_SOLID, enclosed_share, points_inside

MOST_HOLES = 0.15
"""Share of a mesh's area up to which its holes are closed as if by a film: a figurine with an open
base counts as solid. A plane (1), a bowl (0.5) or an open tube does not, see ``openness``."""

AUTO, SOLID, SHEET = "AUTO", "SOLID", "SHEET"
"""What a mesh is to count as: whatever it seems to be, or one of both."""

SHELL_CELLS = 1.0
"""Half the thickness in cells that open meshes are given, so that the grid can hold them."""

OBSTACLE_BAND = 4.0
"""Cells beyond the offset up to which distances are known."""

GENERATOR_REACH = 0.025
"""Metres up to which the generator sees an obstacle (``generator.sparse.closeness``)."""

SLIP_RANGE = (1.0, 3.0)
"""Cells from the obstacle up to which velocity is tangential, and from which it is unchanged."""

TOUCHING = 2.0
"""Cells from an obstacle, beyond its offset, up to which liquid counts as touching it."""

SWALLOWED = (
    "The obstacles swallow the whole splash: move them out of it, make them smaller "
    "or lower the offset"
)

OBSTACLE_RIM = 2.0
"""Width in cells of the rounded edge between the liquid's surface and an obstacle: liquid beside an
obstacle is at least half as thick."""


class ObstacleError(ValueError):
    """An obstacle cannot be used; the message says what to do."""


@dataclass(frozen=True)
class Obstacle:
    """A mesh that liquid keeps out of.

    Attributes
    ----------
    triangles : float64 ``(m, 3, 3)``: triangle, corner, axis; holes closed; metres, or the unit
        of the grid it is used with
    solid : False for an open surface, which counts as a sheet, SHELL_CELLS to either side
    warning : a sentence for the user; empty if there is nothing to say
    """

    triangles: np.ndarray
    solid: bool = True
    warning: str = ""

    def near(self, low: np.ndarray, high: np.ndarray) -> Obstacle:
        """Return the obstacle of those triangles that decide the distance in a box.

        low, high : ``(3,)``, corners of the box, in the unit of the triangles.
        """
        return replace(self, triangles=self.triangles[deciding_triangles(*self.bounds, low, high)])

    def seen_from(self, frame: Frame) -> Obstacle:
        """Return an obstacle in drawing units as one in the local metres of a frame."""
        return replace(self, triangles=frame.points_to_local(self.triangles))

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest coordinates of each triangle, ``(m, 3)`` each."""
        return bounds_of(self.triangles)


@dataclass(frozen=True)
class Clearance:
    """The distance to the nearest obstacle on a grid.

    Attributes
    ----------
    distance : float32 ``(X, Y, Z)``, cells, negative inside, at most +-``band``
    band : cells
    grid : where the cells lie
    """

    distance: np.ndarray
    band: float
    grid: Grid


def obstacle_from_mesh(
    vertices: np.ndarray, faces: np.ndarray, name: str = "", kind: str = AUTO
) -> Obstacle:
    """Return a mesh as an obstacle.

    vertices : ``(n, 3)``; faces : ``(m, 3)`` indices. Parts may overlap, and the normals may all
    point inward. Holes of a solid are closed by films. kind : AUTO takes a mesh for a solid if its
    holes are small (see MOST_HOLES) or if it encloses its inside all the same (see MEANT_SOLID),
    else for a sheet, with a warning. Raises ObstacleError, with the mesh's name, for one that
    encloses nothing or is damaged.
    """
    label = f"Obstacle {name!r}" if name else "The obstacle"
    vertices, faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
    if not len(faces):
        raise ObstacleError(f"{label} has no faces: choose a mesh with faces or remove it")
    if not np.isfinite(vertices).all():
        raise ObstacleError(f"{label} has vertices with invalid coordinates: delete or repair them")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ObstacleError(f"{label} has faces with missing vertices: repair the mesh")
    vertices, faces = welded(vertices, faces)
    triangles = vertices[faces]
    size = triangle_areas(triangles).sum()
    if not size > 0:
        raise ObstacleError(f"{label} has no area: choose a mesh with faces or remove it")
    if kind == SHEET:
        return Obstacle(triangles, False)
    caps = films(vertices, faces)
    share = triangle_areas(caps).sum() / size
    closed = np.concatenate([triangles, caps])
    if kind == SOLID and len(points_inside(closed)):
        return Obstacle(closed)
    if kind != SOLID and (share <= MOST_HOLES or enclosed_share(triangles, caps) >= MEANT_SOLID):
        return Obstacle(closed)
    if kind == SOLID:
        return Obstacle(
            triangles, False,
            f"{label} encloses nothing, even with its holes filled: it counts as a thin sheet",
        )  # fmt: skip
    return Obstacle(
        triangles,
        False,
        f"{label} is not closed (holes are {share:.0%} of its area): it counts as a thin sheet. "
        "To make it solid, choose Solid in Obstacles or fill its holes",
    )


def digest(obstacles: Sequence[Obstacle]) -> str:
    """Return a key that differs for different obstacles: a hash of their triangles."""
    found = hashlib.sha256()
    for obstacle in obstacles:
        found.update(obstacle.triangles.tobytes())
    return found.hexdigest()[:16]


def signed_distance(obstacle: Obstacle, grid: Grid, band: float = OBSTACLE_BAND) -> np.ndarray:
    """Return the distance to an obstacle at cell centres, float32 ``(X, Y, Z)``.

    In cells, negative inside, clipped to +-``band``; exact up to 2 cells, beyond to a tenth of a
    cell.
    """
    triangles = in_cells(obstacle.triangles, grid)
    if not obstacle.solid:
        distance = distance_on_grid(triangles, grid.shape, band + SHELL_CELLS)
        return distance - np.float32(SHELL_CELLS)
    distance = distance_on_grid(triangles, grid.shape, band)
    inside = winding_on_grid(triangles, grid.shape) != 0
    return np.where(inside, -distance, distance)


def in_cells(points: np.ndarray, grid: Grid) -> np.ndarray:
    """Map points ``(..., 3)`` to cells, with cell centres at whole numbers."""
    return np.asarray(grid.to_cells(points) - 0.5)


def clearance(obstacles: Sequence[Obstacle], grid: Grid, band: float = OBSTACLE_BAND) -> Clearance:
    """Return the distance to the nearest of several obstacles; ``band`` where there is none."""
    distance = np.full(grid.shape, band, dtype=np.float32)
    for obstacle in obstacles:
        np.minimum(distance, signed_distance(obstacle, grid, band), out=distance)
    return Clearance(distance, band, grid)


def generator_obstacle(obstacles: Sequence[Obstacle], grid: Grid) -> np.ndarray | None:
    """Return ``Generator.generate``'s obstacle on ``grid`` (local metres); None without any.

    It is the signed distance in cells, ``(X, Y, Z)``, clipped to GENERATOR_REACH.
    """
    if not obstacles:
        return None
    return clearance(obstacles, grid, GENERATOR_REACH / grid.spacing).distance


def carve(liquid: LevelSet, obstacles: Sequence[Obstacle], offset: float = 0.0) -> LevelSet:
    """Return the liquid outside the obstacles, with velocity along them.

    obstacles : in the unit of the liquid's grid. offset : cells of air left around them, 0 or more.
    Raises ObstacleError if no liquid is left.
    """
    if not obstacles:
        return liquid
    near = clearance(obstacles, liquid.grid, OBSTACLE_BAND + offset)
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

    By a smooth maximum: where liquid thins out in a wedge along an obstacle, it ends in a rim
    that the grid can hold. A sharp maximum leaves teeth there.
    """
    carved = smooth_maximum(level, np.float32(offset) - near.distance, OBSTACLE_RIM)
    return np.where(near.distance < near.band, carved, level)


def tangential(velocity: np.ndarray, near: Clearance, offset: float) -> np.ndarray:
    """Return the velocity ``(3, X, Y, Z)`` without its part that runs into the obstacles.

    That part is removed up to ``offset`` + SLIP_RANGE[0] cells from them, and less and less up to
    ``offset`` + SLIP_RANGE[1].
    """
    full, none = offset + SLIP_RANGE[0], offset + SLIP_RANGE[1]
    touched = (near.distance < none) & (near.distance > -near.band)
    if not touched.any():
        return velocity
    normal = unit_gradient(near.distance, np.argwhere(touched)).T
    share = np.clip((none - near.distance[touched]) / (none - full), 0.0, 1.0)
    moving = velocity[:, touched]
    into = np.minimum((moving * normal).sum(axis=0), 0.0)
    result = velocity.copy()
    result[:, touched] = moving - share * into * normal
    return result


def depth_of_points(
    obstacle: Obstacle, points: np.ndarray, cell: float, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the signed distance ``(n,)`` of points in cells, and the closest points ``(n, 3)``.

    points : ``(n, 3)`` in the obstacle's unit; cell : edge of a cell in it. Exact within ``reach``
    cells of the surface; points farther away get +-``reach`` and themselves.
    """
    scaled = np.asarray(points, dtype=np.float64) / cell
    low = obstacle.bounds[0].min(axis=0) / cell - reach - SHELL_CELLS
    high = obstacle.bounds[1].max(axis=0) / cell + reach + SHELL_CELLS
    near = ((scaled > low) & (scaled < high)).all(axis=1)
    distance, nearest = np.full(len(scaled), float(reach)), scaled.copy()
    extent = reach if obstacle.solid else reach + SHELL_CELLS
    found, where, winding = nearest_on_mesh(obstacle.triangles / cell, scaled[near], extent)
    if obstacle.solid:
        found = np.where(winding != 0, -found, found)
    else:
        found = found - SHELL_CELLS
    distance[near], nearest[near] = found, where
    return distance, nearest * cell


def free_share(
    points: np.ndarray, obstacles: Sequence[Obstacle], cell: float, offset: float
) -> np.ndarray:
    """Return how far ``points`` ``(n, 3)`` are from touching an obstacle, float64 ``(n,)``.

    0 at obstacles, up to TOUCHING cells beyond the ``offset`` from them; 1 from twice that on.
    points, obstacles : in the same unit; cell : edge of a cell in it.
    """
    share = np.ones(len(points))
    for obstacle in obstacles if len(points) else ():
        away = depth_of_points(obstacle, points, cell, offset + 2 * TOUCHING)[0] - offset
        share = np.minimum(share, np.clip(away / TOUCHING - 1, 0, 1))
    return share


def outside_obstacles(
    points: np.ndarray, obstacles: Sequence[Obstacle], cell: float, offset: float
) -> np.ndarray:
    """Return which ``points`` ``(n, 3)`` are more than ``offset`` cells from all obstacles.

    points, obstacles : in the same unit; cell : edge of a cell in it.
    """
    outside = np.ones(len(points), dtype=bool)
    for obstacle in obstacles if len(points) else ():
        outside &= depth_of_points(obstacle, points, cell, offset + 1)[0] > offset
    return outside
