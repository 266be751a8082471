# SPDX-License-Identifier: GPL-3.0-or-later
"""Several placed splashes joined into one liquid (paper, Figs. 1 and 13)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..compiling import njit
from ..grid import Grid
from ..liquid.fields import AIR
from ..liquid.smooth_csg import smooth_union
from ..mesh.marching_cubes import level_surface
from ..mesh.mesh import Mesh
from ..mesh.signed_distance import (
    EXACT,
    bounds_of,
    deciding_triangles,
    distance_on_grid,
    winding_on_grid,
)
from ..numeric.trilinear import components_at
from ..progress import Report
from ..sketch.local_frame import Frame
from .placement import CompositionError, Placed
from .sparse_blocks import SIDE, Blocks

MOST_MEMORY = 2 << 30
"""Bytes that a composition may take by default."""

MOST_PLACES = 20_000_000
"""Blocks, full or empty, that the box around a composition may hold: its table then takes 80 MB."""

CELL_BYTES = 16
"""Bytes of the level and velocity of one cell."""

DEPTH_WEIGHT = 1.5
"""Exponent, per cell of depth, of a splash's weight in the velocity: e^1.5 for each cell deeper."""


@dataclass(frozen=True)
class Shape:
    """The surface of a placed splash in cells of the composition, with centres at whole numbers.

    Attributes
    ----------
    triangles : float64 ``(m, 3, 3)``, counter-clockwise seen from outside
    bounds : least and greatest coordinates of each triangle, ``(m, 3)`` each
    blocks : int64 ``(b, 3)``, blocks (in units of SIDE cells) that hold liquid or are near it
    """

    triangles: np.ndarray
    bounds: tuple[np.ndarray, np.ndarray]
    blocks: np.ndarray


def compose(
    parts: Sequence[Placed],
    blend: float = 0.0,
    cell: float | None = None,
    most_memory: int = MOST_MEMORY,
    report: Report | None = None,
) -> Blocks:
    """Return one liquid made of all the splashes, on a grid along the drawing's axes.

    The splashes' own meshes are joined, as exact signed distances, so a splash looks the same
    whatever its rotation and cell size.

    blend : width in cells of the smooth joint; the surface moves by a quarter of it at most, and
    only where splashes are closer to each other than that width.
    cell : edge of the cells in drawing units; None for that of the finest splash.
    most_memory : bytes that the result may take.

    Raises CompositionError (no splash, none with liquid, too much memory, too far apart, a width
    or cell out of range) and whatever ``report`` raises.
    """
    if not parts:
        raise CompositionError("There is no splash to compose: draw or unhide one")
    if not 0 <= blend < np.inf:
        raise CompositionError(f"Blend must be 0 or more, not {blend}")
    cell = min(part.cell for part in parts) if cell is None else cell
    if not 0 < cell < np.inf:
        raise CompositionError(f"The voxel must be larger than 0, not {cell}")
    band = max(AIR, 1.25 * blend + 1.0)
    full = [(part, mesh) for part, mesh in with_meshes(parts) if len(mesh.faces)]
    if not full:
        raise CompositionError("None of the splashes has liquid: lower their Thinness")
    most = most_memory // (CELL_BYTES * SIDE**3)
    shapes = [shape_of(mesh, part.frame, cell, band, most) for part, mesh in full]
    places = np.unique(np.concatenate([shape.blocks for shape in shapes]), axis=0)
    check_count(len(places), most)
    low, high = places.min(axis=0), places.max(axis=0) + 1
    if np.prod((high - low).astype(float)) > MOST_PLACES:
        raise CompositionError(
            "The splashes are too far apart for one model: move them together or keep them separate"
        )
    level = np.empty((len(places), SIDE, SIDE, SIDE), dtype=np.float32)
    velocity = np.zeros((len(places), 3, SIDE, SIDE, SIDE), dtype=np.float32)
    held = [{tuple(row) for row in shape.blocks.tolist()} for shape in shapes]
    kept: list[np.ndarray] = []
    for number, place in enumerate(places):
        if report:
            report("Joining splashes", number / len(places))
        here = [m for m, blocks in enumerate(held) if tuple(place.tolist()) in blocks]
        # Distances beyond AIR only count where splashes may blend.
        reach = band if len(here) > 1 else AIR
        levels = [block_level(shapes[m], place * SIDE, reach) for m in here]
        union = np.minimum(smooth_union(levels, blend), np.float32(AIR))
        if union.min() < AIR:
            level[len(kept)] = union
            add_velocities([full[m][0] for m in here], levels, cell, place, velocity[len(kept)])
            kept.append((place - low) * SIDE)
    x, y, z = (int(n) for n in (high - low) * SIDE)
    corner = low * SIDE * cell
    grid = Grid((x, y, z), cell, (float(corner[0]), float(corner[1]), float(corner[2])))
    return Blocks(level[: len(kept)], velocity[: len(kept)], np.array(kept), grid, AIR)


def add_velocities(
    parts: Sequence[Placed],
    levels: Sequence[np.ndarray],
    cell: float,
    place: np.ndarray,
    velocity: np.ndarray,
) -> None:
    """Fill the velocity ``(3, SIDE, SIDE, SIDE)`` of a block: its parts' mean by depth."""
    weights = np.full((SIDE,) * 3, 1e-9, dtype=np.float32)
    for part, level in zip(parts, levels, strict=True):
        _add_velocity(part.liquid.velocity, *to_local(part, cell, place), level, weights, velocity)
    velocity /= weights


def with_meshes(parts: Sequence[Placed]) -> list[tuple[Placed, Mesh]]:
    """Return the splashes with their surfaces, made only once for all copies of one."""
    made: dict[int, Mesh] = {}
    pairs = []
    for part in parts:
        mesh = part.mesh
        if mesh is None:
            own = part.liquid
            if id(own) not in made:
                made[id(own)] = level_surface(own.level, own.velocity, own.grid)
            mesh = made[id(own)]
        pairs.append((part, mesh))
    return pairs


def check_count(count: int, most: int) -> None:
    """Raise CompositionError if there are more than ``most`` blocks."""
    if count > most:
        size = CELL_BYTES * SIDE**3 / 2**30
        raise CompositionError(
            f"The model would need {count * size:.1f} GB at the voxel size of its finest splash, "
            f"more than the {most * size:.1f} GB allowed: compose fewer splashes, use a preview "
            "resolution, or give the smallest splash a larger size in the drawing"
        )


def shape_of(mesh: Mesh, frame: Frame, cell: float, band: float, most: int) -> Shape:
    """Return a splash's surface in cells; CompositionError if it needs over ``most`` blocks."""
    corners = frame.points_to_drawing(mesh.vertices.astype(np.float64)) / cell - 0.5
    mirror = np.linalg.det(frame.axes) < 0
    triangles = corners[mesh.faces[:, ::-1] if mirror else mesh.faces]
    least, greatest = bounds_of(triangles)
    first = np.floor((least.min(axis=0) - band) / SIDE).astype(np.int64)
    counts = np.floor((greatest.max(axis=0) + band) / SIDE).astype(np.int64) + 1 - first
    # Even a sheet fills a good share of n^(2/3) of the n blocks of its box: before these are made.
    check_count(int(np.prod(counts.astype(float)) ** (2 / 3) / 4), most)
    near = np.zeros(counts, dtype=np.bool_)
    _mark(least - band - first * SIDE, greatest + band - first * SIDE, near)
    middles = (triangles - first * SIDE - (SIDE - 1) / 2) / SIDE
    near |= winding_on_grid(middles, (int(counts[0]), int(counts[1]), int(counts[2]))) != 0
    return Shape(triangles, (least, greatest), np.argwhere(near) + first)


def block_level(shape: Shape, start: np.ndarray, band: float) -> np.ndarray:
    """Return the signed distance to a splash in the block at ``start``, clipped at +-``band``."""
    # Distances beyond EXACT are passed on from cell to cell, also by cells outside the block.
    margin = int(np.ceil(band - EXACT)) + 1
    size = SIDE + 2 * margin
    corner = start - margin
    chosen = deciding_triangles(*shape.bounds, corner - EXACT, corner + size + EXACT)
    triangles = shape.triangles[chosen] - corner
    distance = distance_on_grid(triangles, (size,) * 3, band)
    inside = winding_on_grid(triangles, (size,) * 3) != 0
    inner = (slice(margin, -margin),) * 3
    return np.where(inside, -distance, distance)[inner]


def to_local(
    part: Placed, cell: float, place: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return matrix and shift from a block's cells to the splash's, and velocities' matrix back."""
    frame, grid = part.frame, part.liquid.grid
    matrix = frame.axes * (frame.scale.lengths_to_local(cell) / grid.spacing)
    first = frame.points_to_local((place * SIDE + 0.5) * cell)
    return matrix, grid.to_cells(first), frame.scale.velocities_to_drawing(frame.axes.T)


@njit(cache=True)
def _mark(least, greatest, near):
    """Mark the blocks that triangles touch."""
    for m in range(len(least)):
        for i in range(np.int64(least[m, 0] // SIDE), np.int64(greatest[m, 0] // SIDE) + 1):
            for j in range(np.int64(least[m, 1] // SIDE), np.int64(greatest[m, 1] // SIDE) + 1):
                for k in range(np.int64(least[m, 2] // SIDE), np.int64(greatest[m, 2] // SIDE) + 1):
                    near[i, j, k] = True


@njit(cache=True, fastmath=True)
def _add_velocity(field, matrix, shift, turn, level, weights, velocity):
    """Add a splash's velocity times a weight that grows with the depth in it."""
    at, sampled = np.empty(3), np.empty(3)
    for i in range(SIDE):
        for j in range(SIDE):
            for k in range(SIDE):
                if level[i, j, k] >= AIR:
                    continue
                for a in range(3):
                    at[a] = matrix[a, 0] * i + matrix[a, 1] * j + matrix[a, 2] * k + shift[a]
                components_at(field, at[0], at[1], at[2], sampled)
                weight = np.exp(-DEPTH_WEIGHT * level[i, j, k])
                weights[i, j, k] += weight
                for n in range(3):
                    velocity[n, i, j, k] += weight * (
                        turn[n, 0] * sampled[0] + turn[n, 1] * sampled[1] + turn[n, 2] * sampled[2]
                    )
