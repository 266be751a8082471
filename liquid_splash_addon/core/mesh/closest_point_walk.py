# SPDX-License-Identifier: GPL-3.0-or-later
"""The closest point on a surface, found by walking from a face nearby.

A walk cannot jump to the other side of a thin sheet, as a search in space would.
"""

from __future__ import annotations

from ..compiling import njit
from .halfedge import following

MOST_CROSSINGS = 32
"""Faces that a walk may cross. A move is shorter than an edge and crosses two or three."""


@njit(cache=True)
def walk_to_closest(x, y, z, face, points, start, twin):
    """Return the face and the last two barycentric weights of the point closest to (x, y, z).

    The walk begins at ``face`` and crosses the edge beyond which the point lies. It ends where
    there is no such edge, or on an edge beyond which the point lies as seen from both its faces.
    """
    back = -1
    s, t = 0.0, 0.0
    for _ in range(MOST_CROSSINGS):
        a, b, c = start[3 * face], start[3 * face + 1], start[3 * face + 2]
        s, t = _weights(x, y, z, a, b, c, points)
        r = 1.0 - s - t
        if r >= 0 and s >= 0 and t >= 0:
            return face, s, t
        # Weight k is that of corner k; the edge opposite begins at corner k + 1.
        if r <= s and r <= t:
            edge = 3 * face + 1
        elif s <= t:
            edge = 3 * face + 2
        else:
            edge = 3 * face
        if edge == back:
            return _on_edge(x, y, z, edge, points, start)
        back = twin[edge]
        face = back // 3
    s, t = max(s, 0.0), max(t, 0.0)
    total = max(s + t, 1.0)
    return face, s / total, t / total


@njit(cache=True, inline="always")
def _weights(x, y, z, a, b, c, points):
    """Return the weights of b and c for the point of the plane closest to (x, y, z)."""
    ux, vx, wx = points[b, 0] - points[a, 0], points[c, 0] - points[a, 0], x - points[a, 0]
    uy, vy, wy = points[b, 1] - points[a, 1], points[c, 1] - points[a, 1], y - points[a, 1]
    uz, vz, wz = points[b, 2] - points[a, 2], points[c, 2] - points[a, 2], z - points[a, 2]
    uu, uv, vv = (
        ux * ux + uy * uy + uz * uz,
        ux * vx + uy * vy + uz * vz,
        vx * vx + vy * vy + vz * vz,
    )
    wu, wv = wx * ux + wy * uy + wz * uz, wx * vx + wy * vy + wz * vz
    scale = 1.0 / max(uu * vv - uv * uv, 1e-30 * (uu + vv) ** 2 + 1e-300)
    return (vv * wu - uv * wv) * scale, (uu * wv - uv * wu) * scale


@njit(cache=True)
def _on_edge(x, y, z, edge, points, start):
    """Return the face and weights of the point on a half-edge that is closest to (x, y, z)."""
    a, b = start[edge], start[following(edge)]
    ux, uy, uz = (
        points[b, 0] - points[a, 0],
        points[b, 1] - points[a, 1],
        points[b, 2] - points[a, 2],
    )
    along = (x - points[a, 0]) * ux + (y - points[a, 1]) * uy + (z - points[a, 2]) * uz
    share = min(max(along / max(ux * ux + uy * uy + uz * uz, 1e-300), 0.0), 1.0)
    corner = edge % 3
    if corner == 0:
        return edge // 3, share, 0.0
    if corner == 1:
        return edge // 3, 1.0 - share, share
    return edge // 3, 0.0, 1.0 - share
