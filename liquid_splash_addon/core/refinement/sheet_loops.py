# SPDX-License-Identifier: GPL-3.0-or-later
"""The compiled loops of sheets: smoothing along a mesh, averages across both sides, distances."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from ..numeric.cell_list import cell_list
from ..numeric.threads import in_parts


@njit(cache=True, fastmath=True)
def smooth(values, first, near, factors):
    """Move ``values`` float32 ``(n, k)`` towards the neighbours' mean, in place.

    first, near : the neighbours of each vertex, as in a Laplacian; factors : float32 ``(steps,)``,
    the share of the way in each step; a negative one goes back (Taubin 1995).
    """
    count, width = values.shape
    there = np.empty_like(values)
    for factor in factors:
        if width == 3:  # places: their neighbours are looked up once, not three times
            for v in range(count):
                begin, end = first[v], first[v + 1]
                x, y, z = np.float32(0), np.float32(0), np.float32(0)
                for e in range(begin, end):
                    u = near[e]
                    x, y, z = x + values[u, 0], y + values[u, 1], z + values[u, 2]
                share, number = factor / max(end - begin, 1), np.float32(end - begin)
                there[v, 0] = values[v, 0] + share * (x - number * values[v, 0])
                there[v, 1] = values[v, 1] + share * (y - number * values[v, 1])
                there[v, 2] = values[v, 2] + share * (z - number * values[v, 2])
            values[:] = there
            continue
        for v in range(count):
            begin, end = first[v], first[v + 1]
            share = factor / max(end - begin, 1)
            for k in range(width):
                total = np.float32(0)
                for e in range(begin, end):
                    total += values[near[e], k]
                there[v, k] = values[v, k] + share * (total - (end - begin) * values[v, k])
        values[:] = there


def around(
    points: np.ndarray,
    sources: np.ndarray,
    width: float,
    own: np.ndarray,
    tensor_weights: np.ndarray,
    normals: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return means around each point, weighted by a Gaussian that ends at 2.5 times its width.

    points : float32 ``(n, 3)``; sources : float32 ``(m, 3)``, here the middles of both sides of a
    sheet, so that both take part alike; width : in their unit; own : float32 ``(m,)``, the weight
    of each source in the means; tensor_weights : float32 ``(m,)``, its weight in the plane;
    normals : float32 ``(m, 3)``.

    Returns the sources' means ``(n, 3)`` and the normals of their planes ``(n, 3)`` (the axis of
    the sum of n n^T, to which it does not matter on which side a normal points), 0 where there is
    none. Where no weight is near, a point keeps its place.
    """
    reach = np.float32(2.5 * width)
    low = np.minimum(points.min(axis=0), sources.min(axis=0))
    high = np.maximum(points.max(axis=0), sources.max(axis=0))
    size = tuple(int(n) + 1 for n in (high - low) / reach)
    scaled, placed = (((p - low) / reach).astype(np.float32) for p in (points, sources))
    order, first = cell_list(placed, np.zeros(3, dtype=np.float32), np.float32(1), size)
    held = (
        scaled, placed[order], sources[order], own[order], tensor_weights[order], normals[order],
        first, size,
    )  # fmt: skip
    means, planes = points.copy(), np.zeros_like(points)
    in_parts(len(points), lambda a, b: _around(a, b, *held, means, planes))
    return means, planes


@njit(cache=True, fastmath=True)
def _around(
    start, stop, places, sorted_places, points, own, tensor_weights, normals, first, size,
    means, planes,
):  # fmt: skip
    one, sharp = np.float32(1), np.float32(-0.5 * 2.5 * 2.5)
    for v in range(start, stop):
        x, y, z = places[v, 0], places[v, 1], places[v, 2]
        i, j, k = int(x), int(y), int(z)
        total, cx, cy, cz = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        xx, yy, zz = np.float32(0), np.float32(0), np.float32(0)
        xy, xz, yz = np.float32(0), np.float32(0), np.float32(0)
        for a in range(max(i - 1, 0), min(i + 2, size[0])):
            for b in range(max(j - 1, 0), min(j + 2, size[1])):
                row = (a * size[1] + b) * size[2]
                for u in range(first[row + max(k - 1, 0)], first[row + min(k + 2, size[2])]):
                    dx, dy = sorted_places[u, 0] - x, sorted_places[u, 1] - y
                    dz = sorted_places[u, 2] - z
                    square = dx * dx + dy * dy + dz * dz
                    if square >= one:
                        continue
                    bell = np.exp(sharp * square)
                    w = bell * own[u]
                    total += w
                    cx += w * points[u, 0]
                    cy += w * points[u, 1]
                    cz += w * points[u, 2]
                    w = bell * tensor_weights[u]
                    nx, ny, nz = normals[u, 0], normals[u, 1], normals[u, 2]
                    xx += w * nx * nx
                    yy += w * ny * ny
                    zz += w * nz * nz
                    xy += w * nx * ny
                    xz += w * nx * nz
                    yz += w * ny * nz
        if total > np.float32(1e-6):
            means[v, 0], means[v, 1], means[v, 2] = cx / total, cy / total, cz / total
        _axis(xx, yy, zz, xy, xz, yz, planes[v])


@njit(cache=True, fastmath=True)
def _axis(xx, yy, zz, xy, xz, yz, out):
    """Write the unit axis of the largest eigenvalue of a symmetric matrix, by power iteration."""
    if xx >= max(yy, zz):
        x, y, z = xx, xy, xz
    elif yy >= zz:
        x, y, z = xy, yy, yz
    else:
        x, y, z = xz, yz, zz
    for _ in range(8):
        size = np.sqrt(x * x + y * y + z * z)
        if size < np.float32(1e-9):
            return
        x, y, z = x / size, y / size, z / size
        x, y, z = xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z
    size = max(np.sqrt(x * x + y * y + z * z), np.float32(1e-30))
    out[0], out[1], out[2] = x / size, y / size, z / size


@njit(cache=True)
def spread(points, first, near, sources, limit):
    """Return the distance to the nearest source, and that source, along the mesh's edges.

    points : float32 ``(n, 3)``; sources : bool ``(n,)``; limit : in the points' unit. Each vertex
    hears of sources from its neighbours and measures the straight distance to them, which edges'
    zigzag would make longer. Beyond the limit the distance is infinite and the source -1.
    """
    count = len(points)
    distance = np.full(count, np.float32(np.inf))
    source = np.full(count, -1, dtype=np.int32)
    waiting = np.empty(count + 1, dtype=np.int32)
    queued = np.zeros(count, dtype=np.bool_)
    head, tail = 0, 0
    for v in range(count):
        if sources[v]:
            distance[v], source[v] = 0, v
            waiting[tail] = v
            tail += 1
            queued[v] = True
    while head != tail:
        v = waiting[head]
        head = head + 1 if head < count else 0
        queued[v] = False
        s = source[v]
        for e in range(first[v], first[v + 1]):
            u = near[e]
            dx = points[u, 0] - points[s, 0]
            dy = points[u, 1] - points[s, 1]
            dz = points[u, 2] - points[s, 2]
            away = np.sqrt(dx * dx + dy * dy + dz * dz)
            if away < limit and away < np.float32(0.9999) * distance[u]:
                distance[u], source[u] = away, s
                if not queued[u]:
                    queued[u] = True
                    waiting[tail] = u
                    tail = tail + 1 if tail < count else 0
    return distance, source


@njit(cache=True)
def stretching(points, velocities, faces):
    """Return the divergence of ``velocities`` along the surface at each vertex, float32 ``(n,)``.

    Velocity is linear on each face; a vertex has the mean of its faces, weighted by area. Both
    ``(n, 3)``; the result is in 1 over the unit of time.
    """
    total = np.zeros(len(points))
    weight = np.zeros(len(points))
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        uu, vv, uv = 0.0, 0.0, 0.0
        pu, pv, qu, qv = 0.0, 0.0, 0.0, 0.0
        for n in range(3):
            u, v = points[b, n] - points[a, n], points[c, n] - points[a, n]
            p = velocities[b, n] - velocities[a, n]
            q = velocities[c, n] - velocities[a, n]
            uu, vv, uv = uu + u * u, vv + v * v, uv + u * v
            pu, pv, qu, qv = pu + p * u, pv + p * v, qu + q * u, qv + q * v
        square = uu * vv - uv * uv
        if square <= 1e-6 * uu * vv:
            continue
        # The trace of the velocity's gradient in the plane: metric^-1 times the mixed products.
        rate = (vv * pu - uv * (pv + qu) + uu * qv) / square
        area = np.sqrt(square)
        for n in (a, b, c):
            total[n] += area * rate
            weight[n] += area
    return (total / np.maximum(weight, 1e-30)).astype(np.float32)
