# SPDX-License-Identifier: GPL-3.0-or-later
"""Signed distance to triangle meshes on grids.

Triangles are float64 ``(m, 3, 3)``: triangle, corner, axis; in cells, with cell centres at whole
numbers. A point is inside if the surfaces below it, counted with their orientation, do not cancel:
that is the winding number of a closed mesh, and it allows for overlapping parts.
"""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from ..numeric.triangles import cross_edges

EXACT = 2.0
"""Cells up to which every triangle is tried. Farther cells try only the triangles of their
neighbours, with errors of a hundredth of a cell on average and a tenth at most."""

NUDGE = (2.718e-7, 3.142e-7)
"""Cells by which the vertical lines that count surfaces miss the cell centres, where modelled
meshes often have their edges."""


def distance_on_grid(triangles: np.ndarray, shape: tuple[int, ...], band: float) -> np.ndarray:
    """Return the unsigned distance of cell centres, float32 ``shape``, in cells, up to ``band``."""
    return owned_distance(triangles, shape, band)[0]


def owned_distance(
    triangles: np.ndarray, shape: tuple[int, ...], band: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return :func:`distance_on_grid` and the triangle it is from, int32 ``shape``; -1 for none."""
    square = np.full(shape, band * band, dtype=np.float32)
    owner = np.full(shape, -1, dtype=np.int32)
    if len(triangles):
        _splat(triangles, min(band, EXACT), square, owner)
        if band > EXACT:
            _spread(triangles, square, owner)
    return np.sqrt(square), owner


def winding_on_grid(triangles: np.ndarray, shape: tuple[int, int, int]) -> np.ndarray:
    """Return the winding number of a closed mesh at cell centres, int16 ``shape``."""
    steps = np.zeros((shape[0], shape[1], shape[2] + 1), dtype=np.int16)
    _count(triangles, steps)
    return np.cumsum(steps, axis=2, dtype=np.int16)[:, :, :-1]


def bounds_of(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and greatest coordinates of triangles, ``(m, 3)`` each."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


@njit(cache=True)
def deciding_triangles(least, greatest, low, high):
    """Return which triangles decide the signed distance in a box, bool ``(m,)``.

    They are those in it, and those below it, which decide what is inside.
    least, greatest : see :func:`bounds_of`; low, high : corners of the box, ``(3,)``.
    """
    chosen = np.empty(len(least), dtype=np.bool_)
    for m in range(len(least)):
        chosen[m] = (
            (least[m, 0] <= high[0])
            & (greatest[m, 0] >= low[0])
            & (least[m, 1] <= high[1])
            & (greatest[m, 1] >= low[1])
            & (least[m, 2] <= high[2])
        )
    return chosen


@njit(cache=True, inline="always")
def closest_on_triangle(px, py, pz, t):
    """Return the point of triangle ``t`` ``(3, 3)`` closest to p (Ericson 2005, 5.1.5)."""
    abx, aby, abz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    acx, acy, acz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    apx, apy, apz = px - t[0, 0], py - t[0, 1], pz - t[0, 2]
    aa = abx * abx + aby * aby + abz * abz
    cc = acx * acx + acy * acy + acz * acz
    ac = abx * acx + aby * acy + abz * acz
    d1 = abx * apx + aby * apy + abz * apz
    d2 = acx * apx + acy * apy + acz * apz
    d3, d4 = d1 - aa, d2 - ac
    d5, d6 = d1 - ac, d2 - cc
    vc = d1 * d4 - d3 * d2
    vb = d5 * d2 - d1 * d6
    va = d3 * d6 - d5 * d4
    v, w = 0.0, 0.0
    if d1 <= 0 and d2 <= 0:
        pass
    elif d3 >= 0 and d4 <= d3:
        v = 1.0
    elif d6 >= 0 and d5 <= d6:
        w = 1.0
    elif vc <= 0 and d1 >= 0 and d3 <= 0:
        v = d1 / (d1 - d3) if d1 > d3 else 0.0
    elif vb <= 0 and d2 >= 0 and d6 <= 0:
        w = d2 / (d2 - d6) if d2 > d6 else 0.0
    elif va <= 0 and d4 >= d3 and d5 >= d6:
        along = (d4 - d3) + (d5 - d6)
        w = (d4 - d3) / along if along > 0 else 0.0
        v = 1.0 - w
    else:
        total = va + vb + vc
        v = vb / total if total != 0 else 0.0
        w = vc / total if total != 0 else 0.0
    return (
        t[0, 0] + v * abx + w * acx,
        t[0, 1] + v * aby + w * acy,
        t[0, 2] + v * abz + w * acz,
    )


@njit(cache=True, inline="always")
def _square_to(px, py, pz, t):
    x, y, z = closest_on_triangle(px, py, pz, t)
    return (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2


@njit(cache=True, inline="always")
def _outside(p, low, high):
    """Return how far p lies outside an interval, 0 inside."""
    return max(low - p, p - high, 0.0)


@njit(cache=True)
def _splat(triangles, reach, square, owner):
    """Try every triangle at the cells within ``reach`` of it."""
    shape = square.shape
    low, high = np.empty(3), np.empty(3)
    first, last, cell = np.empty(3, np.int64), np.empty(3, np.int64), np.empty(3, np.int64)
    for m in range(len(triangles)):
        t = triangles[m]
        empty = False
        for a in range(3):
            low[a] = min(t[0, a], t[1, a], t[2, a])
            high[a] = max(t[0, a], t[1, a], t[2, a])
            first[a] = max(np.int64(np.ceil(max(low[a] - reach, -1.0))), 0)
            last[a] = min(np.int64(np.floor(min(high[a] + reach, shape[a] + 1.0))), shape[a] - 1)
            empty |= last[a] < first[a]
        if empty:
            continue
        # Along the normal's largest component only cells near the plane are looked at.
        n = np.array(cross_edges(0, 1, 2, t))
        w = np.argmax(np.abs(n))
        u, v = (w + 1) % 3, (w + 2) % 3
        size = np.sqrt((n * n).sum())
        for at_u in range(first[u], last[u] + 1):
            cell[u] = at_u
            du = _outside(cell[u], low[u], high[u])
            for at_v in range(first[v], last[v] + 1):
                cell[v] = at_v
                dv = _outside(cell[v], low[v], high[v])
                begin, end = first[w], last[w]
                if size > 0:
                    plane = (
                        t[0, w] - (n[u] * (cell[u] - t[0, u]) + n[v] * (cell[v] - t[0, v])) / n[w]
                    )
                    half = reach * size / abs(n[w])
                    begin = max(begin, np.int64(np.ceil(max(plane - half, -1.0))))
                    end = min(end, np.int64(np.floor(min(plane + half, shape[w] + 1.0))))
                for at_w in range(begin, end + 1):
                    cell[w] = at_w
                    dw = _outside(cell[w], low[w], high[w])
                    i, j, k = cell[0], cell[1], cell[2]
                    if du * du + dv * dv + dw * dw < square[i, j, k]:
                        found = _square_to(float(i), float(j), float(k), t)
                        if found < square[i, j, k]:
                            square[i, j, k] = found
                            owner[i, j, k] = m


@njit(cache=True)
def _spread(triangles, square, owner):
    """Pass triangles on from cell to cell as long as a cell finds a closer one."""
    nx, ny, nz = square.shape
    flat = owner.reshape(-1)
    # Only cells near the end of the exact distances have neighbours without any.
    front = np.flatnonzero((flat >= 0) & (square.reshape(-1) > (EXACT - 1.5) ** 2))
    waiting = np.zeros(owner.size, dtype=np.bool_)
    following = np.empty(owner.size, dtype=np.int64)
    while len(front):
        count = 0
        for c in front:
            waiting[c] = False
            i, j, k = c // (ny * nz), c // nz % ny, c % nz
            m = flat[c]
            for a in range(max(i - 1, 0), min(i + 2, nx)):
                for b in range(max(j - 1, 0), min(j + 2, ny)):
                    for d in range(max(k - 1, 0), min(k + 2, nz)):
                        if owner[a, b, d] == m:
                            continue
                        found = np.float32(_square_to(float(a), float(b), float(d), triangles[m]))
                        if found < square[a, b, d]:
                            square[a, b, d] = found
                            owner[a, b, d] = m
                            n = (a * ny + b) * nz + d
                            if not waiting[n]:
                                waiting[n] = True
                                following[count] = n
                                count += 1
        front = following[:count].copy()


@njit(cache=True, inline="always")
def _side(ax, ay, bx, by, px, py):
    """Return +1 or -1, the side of the line from a to b on which p lies; from b to a the opposite.

    The two triangles at an edge run along it in opposite directions: as it is always computed
    from the same end, rounding cannot put a point into both of them or neither.
    """
    if ax < bx or (ax == bx and ay < by):
        return 1 if (bx - ax) * (py - ay) - (by - ay) * (px - ax) >= 0 else -1
    return -1 if (ax - bx) * (py - by) - (ay - by) * (px - bx) >= 0 else 1


@njit(cache=True, inline="always")
def vertical_hit(t, px, py):
    """Return where a vertical line hits a triangle: its orientation, 0 for a miss, and height."""
    side = _side(t[0, 0], t[0, 1], t[1, 0], t[1, 1], px, py)
    if side != _side(t[1, 0], t[1, 1], t[2, 0], t[2, 1], px, py):
        return 0, 0.0
    if side != _side(t[2, 0], t[2, 1], t[0, 0], t[0, 1], px, py):
        return 0, 0.0
    ux, uy, uz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    vx, vy, vz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    area = ux * vy - uy * vx
    if area == 0:
        return side, t[0, 2]
    dx, dy = px - t[0, 0], py - t[0, 1]
    return side, t[0, 2] + ((dx * vy - dy * vx) * uz + (ux * dy - uy * dx) * vz) / area


@njit(cache=True)
def _count(triangles, steps):
    """Add up at each cell how the winding number changes there, coming from below."""
    nx, ny, nz = steps.shape
    for m in range(len(triangles)):
        t = triangles[m]
        left, right = t[:, 0].min(), t[:, 0].max()
        front, back = t[:, 1].min(), t[:, 1].max()
        if right < -1 or back < -1 or left > nx or front > ny:
            continue
        for i in range(max(int(left) - 1, 0), min(int(right) + 2, nx)):
            for j in range(max(int(front) - 1, 0), min(int(back) + 2, ny)):
                side, height = vertical_hit(t, i + NUDGE[0], j + NUDGE[1])
                if side:
                    k = np.int64(np.ceil(min(max(height, 0.0), nz - 1.0)))
                    steps[i, j, k] -= side
