# SPDX-License-Identifier: GPL-3.0-or-later
"""The four passes of remeshing over all edges or vertices; lengths over the target length.

``home`` is the old face on which a vertex lies.
"""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from ..numeric.triangles import cross_edges, squared_length
from .closest_point_walk import walk_to_closest
from .halfedge import (
    adjacent,
    collapse_edge,
    flip_edge,
    following,
    preceding,
    shared_neighbours,
    split_edge,
)

SHORTEST_EDGE, LONGEST_EDGE = 0.7, 1.35
"""Shorter edges are collapsed, longer ones split. Moving vertices afterwards changes lengths by a
few tenths: they end up within 0.5-1.5."""

SPLIT_SHARE = 0.9
"""More than sqrt(0.8), see :func:`split_long`."""

MOST_VALENCE = 9
"""Most edges at a vertex after a collapse."""

FLIP_COSINE = 0.5
"""Cosine of the largest angle by which a flip may turn a face: more would fold the surface."""

SLIVER = 0.2
"""Least height over the longest edge of a face after a collapse."""

COLLAPSE_COSINE = 0.75
"""The same for a collapse, which must keep drops of few vertices round."""

BULGE = 0.12
"""Farthest that a flip may move the surface between the ends of the edge."""


@njit(cache=True)
def split_long(
    points, home, start, twin, out, valence, count, faces, old_points, old_start, old_twin
):
    """Split edges over LONGEST_EDGE; return whether all are done, and the counts of both then.

    The arrays hold more than ``count`` vertices and ``faces`` faces; it stops when they are full.
    Edges within SPLIT_SHARE of the longest go first: the new edge from the middle of such an edge
    to the opposite corner is shorter than that, so each round ends. In another order it might not.
    """
    limit = max(SPLIT_SHARE * _longest(points, start, faces), LONGEST_EDGE)
    while True:
        h = 0
        while h < 3 * faces:
            u, v = start[h], start[following(h)]
            if u < 0 or h > twin[h] or squared_length(u, v, points) <= limit * limit:
                h += 1
                continue
            if count == len(points) or 3 * faces + 6 > len(start):
                return False, count, faces
            # The next pass of moves puts it on the surface.
            for n in range(3):
                points[count, n] = 0.5 * (points[u, n] + points[v, n])
            home[count] = _better_home(
                count, home[u], home[v], points, old_points, old_start, old_twin
            )
            split_edge(h, count, faces, start, twin, out, valence)
            count += 1
            faces += 2
        if limit == LONGEST_EDGE:
            return True, count, faces
        limit = max(SPLIT_SHARE * limit, LONGEST_EDGE)


@njit(cache=True)
def _better_home(w, first, second, points, old_points, old_start, old_twin):
    """Return the old face closest to ``w``, by walks from two faces."""
    x, y, z = points[w, 0], points[w, 1], points[w, 2]
    best, least = first, np.inf
    for face in (first, second):
        face, s, t = walk_to_closest(x, y, z, face, old_points, old_start, old_twin)
        a, b, c = old_start[3 * face], old_start[3 * face + 1], old_start[3 * face + 2]
        square = 0.0
        for n in range(3):
            there = (1 - s - t) * old_points[a, n] + s * old_points[b, n] + t * old_points[c, n]
            square += (there - points[w, n]) ** 2
        if square < least:
            best, least = face, square
    return best


@njit(cache=True)
def _longest(points, start, faces):
    longest = 0.0
    for h in range(3 * faces):
        if start[h] >= 0:
            longest = max(longest, squared_length(start[h], start[following(h)], points))
    return np.sqrt(longest)


@njit(cache=True)
def place(v, face, s, t, points, home, old_points, old_start):
    """Put vertex ``v`` on an old face, at the weights s and t of its last two corners."""
    a, b, c = old_start[3 * face], old_start[3 * face + 1], old_start[3 * face + 2]
    for n in range(3):
        points[v, n] = (1 - s - t) * old_points[a, n] + s * old_points[b, n] + t * old_points[c, n]
    home[v] = face


@njit(cache=True)
def collapse_short(points, start, twin, out, valence, faces):
    """Collapse edges under SHORTEST_EDGE where the surface stays a manifold and does not fold."""
    for h in range(3 * faces):
        if start[h] < 0 or h > twin[h]:
            continue
        u, v = start[h], start[following(h)]
        if squared_length(u, v, points) >= SHORTEST_EDGE * SHORTEST_EDGE:
            continue
        if valence[u] + valence[v] - 4 > MOST_VALENCE:
            continue
        if valence[start[preceding(h)]] <= 3 or valence[start[preceding(twin[h])]] <= 3:
            continue
        if shared_neighbours(u, v, start, twin, out) != 2:
            continue
        # Merge into whichever end does not fold the surface.
        if _may_merge(h, points, start, twin):
            collapse_edge(h, start, twin, out, valence)
        elif _may_merge(twin[h], points, start, twin):
            collapse_edge(twin[h], start, twin, out, valence)


@njit(cache=True)
def _may_merge(h, points, start, twin):
    """Return whether the end of ``h`` may merge into its start: no long edge, no turned face."""
    u = start[h]
    t = twin[h]
    at = twin[preceding(t)]
    v = start[at]
    last = following(h)
    while True:
        a, b = start[following(at)], start[preceding(at)]
        if squared_length(u, a, points) > LONGEST_EDGE * LONGEST_EDGE:
            return False
        if at != last and at != t and not _stays_good(u, v, a, b, points):
            return False
        if at == t:
            return True
        at = twin[preceding(at)]


@njit(cache=True)
def _stays_good(u, v, a, b, points):
    """Return whether face vab may become uab: not turned, and no sliver unless it was one."""
    x, y, z = cross_edges(v, a, b, points)
    p, q, r = cross_edges(u, a, b, points)
    before, after = x * x + y * y + z * z, p * p + q * q + r * r
    flat, floor = squared_length(a, b, points), SLIVER * SLIVER
    was = before / max(flat, squared_length(v, a, points), 1e-30) ** 2
    now = after / max(flat, squared_length(u, a, points), 1e-30) ** 2
    if was < 1e-6:
        # Without area it has no normal that could turn.
        return now >= was
    turned = x * p + y * q + z * r < COLLAPSE_COSINE * np.sqrt(before * after)
    return not turned and (now > floor or now > was)


@njit(cache=True)
def flip_edges(points, start, twin, out, valence, faces, even):
    """Flip edges that have a better alternative.

    even : towards six edges at each vertex; otherwise towards the Delaunay criterion.
    """
    for h in range(3 * faces):
        if start[h] < 0 or h > twin[h]:
            continue
        t = twin[h]
        u, v, a, b = start[h], start[t], start[preceding(h)], start[preceding(t)]
        if valence[u] <= 3 or valence[v] <= 3:
            continue
        if even:
            gain = _off(valence[u], -1) + _off(valence[v], -1)
            gain += _off(valence[a], 1) + _off(valence[b], 1)
            if gain >= 0:
                continue
        elif not _obtuse(u, v, a, b, points):
            continue
        if _may_flip(u, v, a, b, points) and not adjacent(a, b, start, twin, out):
            flip_edge(h, start, twin, out, valence)


@njit(cache=True, inline="always")
def _off(valence, change):
    """Return how the squared distance to a valence of 6 changes."""
    return (valence + change - 6) ** 2 - (valence - 6) ** 2


@njit(cache=True)
def _obtuse(u, v, a, b, points):
    """Return whether the angles at a and b, opposite the edge uv, sum to more than 180 degrees."""
    return _cotangent(a, u, v, points) + _cotangent(b, v, u, points) < -1e-3


@njit(cache=True, inline="always")
def _cotangent(a, b, c, points):
    """Return the cotangent of the angle at a."""
    x, y, z = cross_edges(a, b, c, points)
    dot = squared_length(a, b, points) + squared_length(a, c, points) - squared_length(b, c, points)
    return 0.5 * dot / max(np.sqrt(x * x + y * y + z * z), 1e-12)


@njit(cache=True)
def _may_flip(u, v, a, b, points):
    """Return whether the edge ab fits the surface about as well as uv."""
    if squared_length(a, b, points) > LONGEST_EDGE * LONGEST_EDGE:
        return False
    x, y, z = cross_edges(u, v, a, points)
    p, q, r = cross_edges(v, u, b, points)
    nx, ny, nz = x + p, y + q, z + r
    size = np.sqrt(nx * nx + ny * ny + nz * nz)
    high = 0.0
    for n, part in ((0, nx), (1, ny), (2, nz)):
        high += part * (points[a, n] + points[b, n] - points[u, n] - points[v, n])
    if abs(high) > 2 * BULGE * size:
        return False
    x, y, z = cross_edges(u, b, a, points)
    p, q, r = cross_edges(v, a, b, points)
    first, second = x * nx + y * ny + z * nz, p * nx + q * ny + r * nz
    small = min(x * x + y * y + z * z, p * p + q * q + r * r)
    return (
        first > FLIP_COSINE * size * np.sqrt(x * x + y * y + z * z)
        and second > FLIP_COSINE * size * np.sqrt(p * p + q * q + r * r)
        and small > 0.04
    )


@njit(cache=True)
def move_vertices(points, home, start, twin, out, count, old_points, old_start, old_twin):
    """Move each vertex along the surface to the mean of its neighbours, unless a face turns."""
    for v in range(count):
        if out[v] < 0:
            continue
        nx, ny, nz, mx, my, mz, number = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
        h = out[v]
        while True:
            a, b = start[following(h)], start[preceding(h)]
            x, y, z = cross_edges(v, a, b, points)
            nx, ny, nz = nx + x, ny + y, nz + z
            mx, my, mz = mx + points[a, 0], my + points[a, 1], mz + points[a, 2]
            number += 1
            h = twin[preceding(h)]
            if h == out[v]:
                break
        size = max(np.sqrt(nx * nx + ny * ny + nz * nz), 1e-12)
        nx, ny, nz = nx / size, ny / size, nz / size
        x, y, z = mx / number - points[v, 0], my / number - points[v, 1], mz / number - points[v, 2]
        away = x * nx + y * ny + z * nz
        x, y, z = (
            points[v, 0] + x - away * nx,
            points[v, 1] + y - away * ny,
            points[v, 2] + z - away * nz,
        )
        face, s, t = walk_to_closest(x, y, z, home[v], old_points, old_start, old_twin)
        x, y, z, before = points[v, 0], points[v, 1], points[v, 2], home[v]
        place(v, face, s, t, points, home, old_points, old_start)
        if _turned(v, nx, ny, nz, points, start, twin, out):
            points[v, 0], points[v, 1], points[v, 2], home[v] = x, y, z, before


@njit(cache=True)
def _turned(v, nx, ny, nz, points, start, twin, out):
    """Return whether a face at v is a sliver or turned away from the normal that v had."""
    h = out[v]
    while True:
        x, y, z = cross_edges(v, start[following(h)], start[preceding(h)], points)
        ahead = x * nx + y * ny + z * nz
        if ahead <= 0.2 * np.sqrt(x * x + y * y + z * z) or ahead < 0.05:
            return True
        h = twin[preceding(h)]
        if h == out[v]:
            return False


@njit(cache=True)
def weights_at(points, home, old_points, old_start, old_twin):
    """Update ``home``; return the weights of its corners at each point, float32 ``(n, 3)``."""
    weights = np.empty((len(points), 3), dtype=np.float32)
    for v in range(len(points)):
        x, y, z = points[v, 0], points[v, 1], points[v, 2]
        face, s, t = walk_to_closest(x, y, z, home[v], old_points, old_start, old_twin)
        home[v] = face
        weights[v, 0], weights[v, 1], weights[v, 2] = max(1 - s - t, 0.0), s, t
    return weights
