# SPDX-License-Identifier: GPL-3.0-or-later
"""Streamlines of a flow, and the few of them that an artist would draw (paper, 4.2.2)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..compiling import njit
from ..numeric.trilinear import trilinear, velocity_at

LINE_STEP = 0.5
"""Arc length of an integration step, cells."""

MOST_OUTSIDE_LIQUID = 0.5
"""Cells outside the liquid at which a line ends."""

PROBE = 0.7
"""Half the width of the central differences for the surface's normal, cells."""

SHORTEST_LINE = 4.0
"""Lines shorter than this many cells are dropped."""

LOOP_WIDTH = 1.0
"""A line ends when it comes this close to an earlier point of itself, cells."""

REVERSED = np.array([1, 1, 1, -1, -1, -1])
"""Factors that reverse the velocity of a line's points and leave their positions."""

CLUSTER_POINTS = 16
"""Points of each line that are used for the Hausdorff distance."""


def seed_points(distance: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return points ``(count, 3)`` in cells, spread uniformly over the liquid; none without liquid.

    distance : signed distance ``(X, Y, Z)``.
    """
    inside = np.flatnonzero(distance < 0)
    if not len(inside):
        return np.zeros((0, 3))
    # Stratified: every cell is equally likely, and seeds keep apart.
    chosen = inside[((np.arange(count) + rng.random(count)) * len(inside) / count).astype(int)]
    cells = np.stack(np.unravel_index(chosen, distance.shape), axis=1)
    return np.asarray(cells + rng.random(cells.shape))


def trace(
    distance: np.ndarray,
    velocity: np.ndarray,
    seeds: np.ndarray,
    lengths: np.ndarray,
    skin: float = 0.0,
    both_ways: bool = False,
) -> list[np.ndarray]:
    """Return the streamlines from ``seeds`` by RK4 in arc length (eq. 1), in flow direction.

    A line ends at its length, where it leaves the liquid or the arrays, where the flow rests, or
    where it returns to itself; lines under SHORTEST_LINE are dropped.

    distance : float32 ``(X, Y, Z)``, cells; velocity : float32 ``(X', Y', Z', 3)``, on cells
    ``X / X'`` times as large; seeds : ``(n, 3)``, cells; lengths : ``(n,)``, cells, each way.
    skin : depth under the surface, cells, from which lines are turned along the surface: they
    follow the flow without a growing share of its outward part, and their velocities are those.
    A sheet moves across itself, so plain streamlines soon leave it.
    both_ways : trace against the flow as well, so that a line passes through its seed instead of
    beginning there.

    Each result is ``(m, 6)``: position in cells, velocity in the unit of ``velocity``.
    """
    shrink = velocity.shape[0] / distance.shape[0]
    against = -velocity if both_ways else None
    lines = []
    buffer = np.empty((int(lengths.max() / LINE_STEP) + 2 if len(lengths) else 0, 6))
    for seed, length in zip(seeds, lengths, strict=True):
        line = buffer[: _trace(distance, velocity, shrink, skin, seed, length, buffer)].copy()
        if against is not None and len(line) and not _closed(line):
            before = buffer[1 : _trace(distance, against, shrink, skin, seed, length, buffer)]
            line = np.concatenate([before[::-1] * REVERSED, line])
        if (len(line) - 1) * LINE_STEP >= SHORTEST_LINE:
            lines.append(line.astype(np.float32))
    return lines


def _closed(line: np.ndarray) -> bool:
    """Whether the line returned to its start: against the flow it would then be the same."""
    gap = np.linalg.norm(line[-1, :3] - line[0, :3])
    return bool(len(line) * LINE_STEP > SHORTEST_LINE and gap <= LOOP_WIDTH + LINE_STEP)


@njit(cache=True)
def _trace(distance, velocity, shrink, skin, seed, length, buffer):
    """Write the line into ``buffer``; return how many points it has."""
    u = np.empty(3)
    tangents = np.empty((4, 3))
    position = seed.copy()
    for point in range(int(length / LINE_STEP) + 1):
        if trilinear(distance, position[0], position[1], position[2]) > MOST_OUTSIDE_LIQUID:
            return point
        speed = _flow_along(distance, velocity, shrink, skin, position, u)
        if speed < 1e-3:
            return point
        if _comes_back(buffer, point, position):
            return point
        buffer[point, :3] = position
        buffer[point, 3:] = u
        tangents[0] = u / speed
        for stage in range(1, 4):
            reach = LINE_STEP if stage == 3 else LINE_STEP / 2
            at = position + reach * tangents[stage - 1]
            speed = _flow_along(distance, velocity, shrink, skin, at, u)
            if speed < 1e-3:
                return point + 1
            tangents[stage] = u / speed
        position = position + LINE_STEP / 6 * (
            tangents[0] + 2 * tangents[1] + 2 * tangents[2] + tangents[3]
        )
    return point + 1


@njit(cache=True)
def _flow_along(distance, velocity, shrink, skin, at, u):
    """Write the flow at a point (cells), turned along the surface, into ``u``; return its speed."""
    speed = velocity_at(velocity, at[0] * shrink, at[1] * shrink, at[2] * shrink, u)
    if skin == 0:
        return speed
    share = min(max(trilinear(distance, at[0], at[1], at[2]) / skin + 1, 0.0), 1.0)
    if share == 0:
        return speed
    normal = np.empty(3)
    probe = at.copy()
    for axis in range(3):
        probe[axis] = at[axis] + PROBE
        ahead = trilinear(distance, probe[0], probe[1], probe[2])
        probe[axis] = at[axis] - PROBE
        normal[axis] = ahead - trilinear(distance, probe[0], probe[1], probe[2])
        probe[axis] = at[axis]
    square = (normal * normal).sum()
    outward = (u * normal).sum()
    if square > 1e-12 and outward > 0:
        u -= share * outward / square * normal
    return np.sqrt((u * u).sum())


@njit(cache=True)
def _comes_back(buffer, count, position):
    # The latest points are near by construction: skip those of two loop widths.
    for earlier in range(count - int(2 * LOOP_WIDTH / LINE_STEP) - 1):
        square = 0.0
        for axis in range(3):
            square += (buffer[earlier, axis] - position[axis]) ** 2
        if square < LOOP_WIDTH * LOOP_WIDTH:
            return True
    return False


def hausdorff(lines: Sequence[np.ndarray]) -> np.ndarray:
    """Return symmetric Hausdorff distances between lines ``(m, 3+)``, condensed ``(n(n-1)/2,)``.

    Each line is thinned to CLUSTER_POINTS points first.
    """
    thin = np.stack(
        [
            line[np.linspace(0, len(line) - 1, CLUSTER_POINTS).round().astype(int), :3]
            for line in lines
        ]
    ).astype(np.float32)
    return _hausdorff(thin)


@njit(cache=True, fastmath=True)
def _hausdorff(lines):
    count, points, _ = lines.shape
    out = np.empty(count * (count - 1) // 2)
    nearest = np.empty(points, dtype=np.float32)
    n = 0
    for a in range(count):
        for b in range(a + 1, count):
            worst = np.float32(0)
            nearest[:] = 1e30
            for i in range(points):
                best = np.float32(1e30)
                for j in range(points):
                    x = lines[a, i, 0] - lines[b, j, 0]
                    y = lines[a, i, 1] - lines[b, j, 1]
                    z = lines[a, i, 2] - lines[b, j, 2]
                    d = x * x + y * y + z * z
                    best = min(best, d)
                    nearest[j] = min(nearest[j], d)
                worst = max(worst, best)
            out[n] = np.sqrt(max(worst, nearest.max()))
            n += 1
    return out


def representatives(lines: Sequence[np.ndarray], count: int) -> list[int]:
    """Return the numbers of the lines that represent ``count`` clusters, their medoids.

    Clusters of average linkage by :func:`hausdorff`. Fewer lines than that are all returned.
    """
    from scipy.cluster.hierarchy import fcluster, linkage
    from scipy.spatial.distance import squareform

    if len(lines) <= count:
        return list(range(len(lines)))
    distances = hausdorff(lines)
    labels = fcluster(linkage(distances, "average"), count, "maxclust")
    square = squareform(distances)
    chosen = []
    for label in np.unique(labels):
        members = np.flatnonzero(labels == label)
        inner = square[np.ix_(members, members)].sum(axis=1)
        chosen.append(int(members[np.argmin(inner)]))
    return chosen
