# SPDX-License-Identifier: GPL-3.0-or-later
"""Strokes out of a flow: a simulated surface, or particles, become a sketch that can be edited.

The strokes are what the training data shows the generator of a simulation: streamlines through the
liquid, clustered down to the few that an artist would draw (paper, 4.2.2).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..fluid.streamlines import representatives, seed_points, trace
from ..grid import Grid
from ..obstacles.obstacles import ObstacleError, obstacle_from_mesh, signed_distance
from ..progress import Report, silent
from ..sketch.drawing import Drawing
from .streamline_settings import StreamlineSettings

TRACED = 160
"""Streamlines of which the strokes are chosen."""

DEPTH = 1.0
"""Cells under the surface from which on lines are turned along it: a sheet moves across itself."""

REACH = 1.0
"""Length of a line each way from its seed, over the longest side: through the whole splash."""

MARGIN = 4
"""Cells of air around the liquid."""

BAND = 4.0
"""Cells around the surface in which distance and velocity are known."""

NEIGHBOURS = 4
"""Vertices, or particles, whose velocities are averaged, by the inverse square of the distance."""

KEPT_POINTS = 4
"""One in so many traced points is kept: two cells apart."""

DEEP = 1.0
"""Depth from which the velocity is continued from the surface, cells."""

CONTINUED = 1e-4
"""Relative residual of that continuation."""

BUMPS = 1.0
"""Standard deviation of the smoothing of particles' distance, cells."""

APART = 7
"""The sixth neighbour, oneself counted, is as far as particles are apart, in order or at random."""

PARTICLE_RADIUS = 1.0
"""Radius of a particle's liquid over how far they are apart."""


class FlowError(ValueError):
    """No strokes can be found; the message says what to do."""


def strokes_of_surface(
    vertices: np.ndarray,
    faces: np.ndarray,
    velocities: np.ndarray,
    settings: StreamlineSettings,
    report: Report | None = None,
) -> list[Drawing]:
    """Return strokes along the flow of a closed surface, as fast as it is.

    vertices : ``(n, 3)``; faces : ``(m, 3)`` indices; velocities : ``(n, 3)``, units per second.
    Raises FlowError where the surface holds no liquid or does not move.
    """
    report = report or silent
    vertices = checked(vertices, velocities)
    report("Measuring the liquid", 0.0)
    grid = grid_around(vertices, settings.cells, 0.0)
    try:
        obstacle = obstacle_from_mesh(vertices, faces)
    except ObstacleError as error:
        raise FlowError("The mesh has no faces to hold liquid: choose another frame") from error
    distance = signed_distance(obstacle, grid, BAND)
    flow = spread(distance, grid, vertices, velocities)
    return strokes_in(distance, filled(flow, deeper(distance)), grid, settings, report)


def strokes_of_particles(
    positions: np.ndarray,
    velocities: np.ndarray,
    settings: StreamlineSettings,
    report: Report | None = None,
) -> list[Drawing]:
    """Return strokes along the flow of particles, as :func:`strokes_of_surface` does.

    positions, velocities : ``(n, 3)``, units and units per second. Their liquid is what is nearer
    to one than PARTICLE_RADIUS times how far they are apart, and a cell at least.
    """
    from scipy.ndimage import gaussian_filter
    from scipy.spatial import cKDTree

    report = report or silent
    positions = checked(positions, velocities)
    report("Measuring the liquid", 0.0)
    tree = cKDTree(positions)
    apart = float(np.median(tree.query(positions, k=[min(APART, len(positions))])[0]))
    grid = grid_around(positions, settings.cells, PARTICLE_RADIUS * apart)
    radius = max(PARTICLE_RADIUS * apart, grid.spacing)
    centres = grid.to_metres(np.indices(grid.shape).reshape(3, -1).T + 0.5)
    away = tree.query(centres, distance_upper_bound=radius + BAND * grid.spacing)[0]
    bumpy = np.minimum((away - radius) / grid.spacing, BAND).astype(np.float32)
    distance = gaussian_filter(bumpy.reshape(grid.shape), BUMPS)
    return strokes_in(
        distance, spread(distance, grid, positions, velocities), grid, settings, report
    )


def checked(points: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    """Return points ``(n, 3)`` as float64. Raises FlowError for what has no flow."""
    points = np.asarray(points, dtype=np.float64)
    if len(points) < 2 or not np.ptp(points, axis=0).max() > 0:
        raise FlowError("There is no liquid in it: choose a frame that shows some")
    if not (np.isfinite(points).all() and np.isfinite(velocities).all()):
        raise FlowError("It has positions or velocities that are not numbers: simulate it again")
    if not np.any(velocities):
        raise FlowError("All its velocities are zero: choose a frame in which it moves")
    return points


def grid_around(points: np.ndarray, cells: int, radius: float) -> Grid:
    """Return a grid of ``cells`` along the longest side of the points, with air around them.

    radius : of the liquid around each point. Its sides are even: velocity has cells twice as large.
    """
    low, high = points.min(axis=0) - radius, points.max(axis=0) + radius
    spacing = float((high - low).max()) / cells
    shape = 2 * np.ceil((high - low) / spacing / 2 + MARGIN).astype(int)
    origin = (low + high) / 2 - shape * spacing / 2
    return Grid(tuple(shape.tolist()), spacing, tuple(origin.tolist()))


def strokes_in(
    distance: np.ndarray,
    flow: np.ndarray,
    grid: Grid,
    settings: StreamlineSettings,
    report: Report,
) -> list[Drawing]:
    """Return the strokes of liquid on a grid.

    distance : signed, cells, ``(X, Y, Z)``; flow : ``(X/2, Y/2, Z/2, 3)``, units per second
    Raises FlowError where there are no streamlines.
    """
    report("Tracing streamlines", 0.3)
    rng = np.random.default_rng(settings.seed)
    seeds = seed_points(distance, TRACED, rng)
    reach = np.full(len(seeds), REACH * settings.cells)
    unit = float(np.linalg.norm(flow, axis=-1).max())  # slow flows move too
    lines = trace(distance, flow / unit, seeds, reach, DEPTH, both_ways=True)
    if not lines:
        raise FlowError("Its liquid is too thin to trace: choose a higher Resolution")
    report("Choosing strokes", 0.7)
    return [
        drawing_of(lines[number] * np.array([1, 1, 1, unit, unit, unit]), grid)
        for number in representatives(lines, settings.strokes)
    ]


def deeper(distance: np.ndarray) -> np.ndarray:
    """Return the cells twice as large that lie wholly under DEEP, bool ``(X/2, Y/2, Z/2)``."""
    x, y, z = (n // 2 for n in distance.shape)
    return np.asarray((distance < -DEEP).reshape(x, 2, y, 2, z, 2).all(axis=(1, 3, 5)))


def spread(
    distance: np.ndarray, grid: Grid, points: np.ndarray, velocities: np.ndarray
) -> np.ndarray:
    """Return the velocity in and around the liquid, float32 ``(X/2, Y/2, Z/2, 3)``.

    distance : signed, cells, ``(X, Y, Z)``; zero beyond BAND.
    """
    from scipy.spatial import cKDTree

    shape = tuple(n // 2 for n in distance.shape)
    x, y, z = shape
    near = (distance < BAND).reshape(x, 2, y, 2, z, 2).any(axis=(1, 3, 5))
    centres = grid.to_metres(2.0 * np.argwhere(near) + 1.0)
    count = min(NEIGHBOURS, len(points))
    away, found = cKDTree(points).query(centres, k=count)
    away, found = away.reshape(-1, count), found.reshape(-1, count)
    weights = 1 / (away**2 + (1e-3 * grid.spacing) ** 2)
    weights /= weights.sum(axis=1, keepdims=True)
    flow = np.zeros((*shape, 3))
    flow[near] = np.einsum("nk,nka->na", weights, np.asarray(velocities, dtype=np.float64)[found])
    return flow.astype(np.float32)


def filled(flow: np.ndarray, deep: np.ndarray) -> np.ndarray:
    """Return a flow ``(x, y, z, 3)`` with its harmonic continuation where it is ``deep``.

    Nothing is known under a surface but what it does itself; of two sides of thick liquid, the
    nearest vertices would show one. Flows that are linear in space are continued exactly.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.linalg import cg

    numbers = np.full(deep.shape, -1)
    cells = np.argwhere(deep)
    numbers[tuple(cells.T)] = np.arange(len(cells))
    sides = np.concatenate([np.eye(3, dtype=int), -np.eye(3, dtype=int)])
    known = np.zeros((len(cells), 3))
    rows, columns = [np.arange(len(cells))], [np.arange(len(cells))]
    for side in sides:
        beside = tuple((cells + side).T)
        other = numbers[beside]
        inner = other >= 0
        known[~inner] += flow[beside][~inner]
        rows.append(np.flatnonzero(inner))
        columns.append(other[inner])
    row, column = np.concatenate(rows), np.concatenate(columns)
    values = np.where(row == column, float(len(sides)), -1.0)
    matrix = coo_array((values, (row, column)), shape=2 * (len(cells),)).tocsr()
    result = flow.copy()
    for axis in range(3):
        start = flow[..., axis][deep]
        solved, _ = cg(matrix, known[:, axis], x0=start, rtol=CONTINUED, maxiter=500)
        result[..., axis][deep] = solved
    return result


def drawing_of(line: np.ndarray, grid: Grid) -> Drawing:
    """Return a streamline ``(m, 6)`` (cells, units per second) as if drawn at its own speed."""
    thin = np.concatenate([line[:-1:KEPT_POINTS], line[-1:]]).astype(np.float64)
    points = grid.to_metres(thin[:, :3])
    speeds = np.linalg.norm(thin[:, 3:], axis=1)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    times = np.concatenate([[0.0], np.cumsum(2 * steps / (speeds[1:] + speeds[:-1]))])
    return Drawing(points, times, np.ones(len(points)), speeds)


def slowed(drawings: Sequence[Drawing], factor: float) -> list[Drawing]:
    """Return drawings as if drawn ``factor`` times as fast."""
    return [
        Drawing(
            d.points,
            None if d.times is None else d.times / factor,
            d.pressures,
            None if d.speeds is None else d.speeds * factor,
        )
        for d in drawings
    ]
