# SPDX-License-Identifier: GPL-3.0-or-later
"""Half-edges of a closed triangle mesh, and the three edits that keep it a manifold.

Half-edge ``3 f + k`` runs from corner k of face f to the next one. ``start`` holds the vertex at
which it begins (-1: the face is deleted), ``twin`` the half-edge in the opposite direction, ``out``
one half-edge out of each vertex (-1: the vertex is deleted), ``valence`` how many edges it has.
"""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from ..numeric.cell_list import counting_sort


class NotClosedError(ValueError):
    """Some edge of a mesh does not have exactly two faces, one along it in each direction."""


def connect(faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return start and twin ``(3 m,)`` and the old vertex of each new one ``(n,)``, all int32.

    A vertex where several fans of faces touch becomes one vertex for each fan.

    faces : int ``(m, 3)``; count : number of vertices. Raises ValueError for faces with vertices
    outside that, NotClosedError.
    """
    start = np.ascontiguousarray(faces, dtype=np.int32).reshape(-1).copy()
    if len(start) and (start.min() < 0 or start.max() >= count):
        raise ValueError("faces refer to vertices that do not exist")
    twin = np.full(len(start), -1, dtype=np.int32)
    if not _pair(start, twin, count):
        raise NotClosedError("the mesh is not closed: an edge does not have exactly two faces")
    old = _one_fan_each(start, twin, count)
    return start, twin, old


@njit(cache=True)
def _pair(start, twin, count):
    """Find the twins; return whether every half-edge has one."""
    leaving, first = counting_sort(start, count)
    for h in range(len(start)):
        if twin[h] >= 0:
            continue
        begin, end = start[h], start[following(h)]
        for place in range(first[end], first[end + 1]):
            other = leaving[place]
            if twin[other] < 0 and start[following(other)] == begin and other != h:
                twin[h], twin[other] = other, h
                break
        if twin[h] < 0:
            return False
    return True


@njit(cache=True)
def _one_fan_each(start, twin, count):
    """Give every fan of faces a vertex of its own; return the old vertex of each."""
    # All vertices, those without faces too, and at most a fan for each half-edge besides.
    old = np.empty(count + len(start), dtype=np.int32)
    taken = np.zeros(count, dtype=np.bool_)
    seen = np.zeros(len(start), dtype=np.bool_)
    for v in range(count):
        old[v] = v
    total = count
    for h in range(len(start)):
        if seen[h]:
            continue
        vertex = start[h]
        name = vertex
        if taken[vertex]:
            name, total = total, total + 1
            old[name] = vertex
        taken[vertex] = True
        at = h
        while not seen[at]:
            seen[at] = True
            start[at] = name
            at = twin[preceding(at)]
    return old[:total].copy()


@njit(cache=True, inline="always")
def following(h):
    """Return the next half-edge of the face."""
    return h - 2 if h % 3 == 2 else h + 1


@njit(cache=True, inline="always")
def preceding(h):
    """Return the previous half-edge of the face."""
    return h + 2 if h % 3 == 0 else h - 1


@njit(cache=True)
def anchor(start, twin, out, valence):
    """Fill ``out`` and ``valence`` from the other arrays."""
    out[:] = -1
    valence[:] = 0
    for h in range(len(start)):
        if start[h] >= 0:
            out[start[h]] = h
            valence[start[h]] += 1


@njit(cache=True)
def adjacent(a, b, start, twin, out):
    """Return whether an edge joins vertices ``a`` and ``b``."""
    h = out[a]
    while True:
        if start[following(h)] == b:
            return True
        h = twin[preceding(h)]
        if h == out[a]:
            return False


@njit(cache=True)
def shared_neighbours(a, b, start, twin, out):
    """Return how many vertices have an edge to both ``a`` and ``b``."""
    count = 0
    h = out[a]
    while True:
        if adjacent(start[following(h)], b, start, twin, out):
            count += 1
        h = twin[preceding(h)]
        if h == out[a]:
            return count


@njit(cache=True, inline="always")
def _join(a, b, twin):
    twin[a] = b
    twin[b] = a


@njit(cache=True)
def split_edge(h, w, face, start, twin, out, valence):
    """Put vertex ``w`` on half-edge ``h``; ``face`` and the one after it are free for use."""
    t = twin[h]
    hn, hp, tn, tp = following(h), preceding(h), following(t), preceding(t)
    u, v, a, b = start[h], start[t], start[hp], start[tp]
    new = 3 * face
    start[new], start[new + 1], start[new + 2] = w, v, a
    start[new + 3], start[new + 4], start[new + 5] = w, u, b
    _join(new + 1, twin[hn], twin)
    _join(new + 4, twin[tn], twin)
    _join(h, new + 3, twin)
    _join(t, new, twin)
    _join(hn, new + 2, twin)
    _join(tn, new + 5, twin)
    start[hn] = w
    start[tn] = w
    out[w], out[v], out[u] = hn, t, h
    valence[w] = 4
    valence[a] += 1
    valence[b] += 1


@njit(cache=True)
def collapse_edge(h, start, twin, out, valence):
    """Merge the end of half-edge ``h`` into its start; deletes two faces and a vertex."""
    t = twin[h]
    hn, hp, tn, tp = following(h), preceding(h), following(t), preceding(t)
    u, v, a, b = start[h], start[t], start[hp], start[tp]
    at = t
    while True:
        start[at] = u
        at = twin[preceding(at)]
        if at == t:
            break
    valence[u] += valence[v] - 4
    valence[a] -= 1
    valence[b] -= 1
    out[a], out[u], out[b] = twin[hn], twin[hp], twin[tn]
    out[v], valence[v] = -1, 0
    _join(twin[hn], twin[hp], twin)
    _join(twin[tn], twin[tp], twin)
    start[h], start[hn], start[hp] = -1, -1, -1
    start[t], start[tn], start[tp] = -1, -1, -1


@njit(cache=True)
def flip_edge(h, start, twin, out, valence):
    """Flip the edge of half-edge ``h`` in the quad of its two faces."""
    t = twin[h]
    hn, hp, tn, tp = following(h), preceding(h), following(t), preceding(t)
    u, v, a, b = start[h], start[t], start[hp], start[tp]
    _join(h, twin[tn], twin)
    _join(t, twin[hn], twin)
    _join(hn, tn, twin)
    start[hn] = b
    start[tn] = a
    out[u], out[v], out[a], out[b] = h, t, hp, tp
    valence[u] -= 1
    valence[v] -= 1
    valence[a] += 1
    valence[b] += 1
