# SPDX-License-Identifier: GPL-3.0-or-later
"""Beads along rims: where they lie, and how much a rim swells there (Rayleigh-Plateau)."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from .settings import SheetSettings
from .sheet_mesh import SheetMesh

IRREGULAR = 0.15
"""Share by which distances differ."""

BEAD_WIDTH = 0.19
"""Width of a bead's bell over their distance."""

NARROW = 0.3
"""Share by which the rim narrows between beads at full strength."""


def bead_swelling(
    prepared: SheetMesh, rim: np.ndarray, away: np.ndarray, settings: SheetSettings
) -> np.ndarray:
    """Return the factor of the rim's radius at each vertex, float32 ``(n,)``.

    rim : radius at each vertex, m; away : see :func:`beads`.
    """
    phase = away / np.maximum(settings.spacing * BEAD_WIDTH * rim, 1e-9)
    bell = np.exp(-0.5 * phase**2)
    on_rim = 1 + settings.beads * ((1 + NARROW) * bell - NARROW)
    return np.where(prepared.rim >= 0, on_rim[prepared.rim], 1).astype(np.float32)


def beads(
    prepared: SheetMesh, rim: np.ndarray, settings: SheetSettings
) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices in the middles of beads, and the way along the rim to the nearest, m.

    Beads are set out from a random place of each rim, each at its distance from those before; the
    way ``(n,)`` is infinite off the rims.
    """
    on_rim = prepared.rim == np.arange(len(rim))
    rng = np.random.default_rng(settings.seed)
    pace = rng.uniform(1 - IRREGULAR, 1 + IRREGULAR, len(rim)).astype(np.float32)
    apart = np.float32(settings.spacing) * rim * pace
    order = rng.permutation(np.flatnonzero(on_rim)).astype(np.int32)
    return _set_out(
        prepared.faired, prepared.first, prepared.near, on_rim, (prepared.share > 0.5), order, apart
    )


@njit(cache=True)
def _walk(begin, points, first, near, on_rim, away, waiting, queued):
    """Lower ``away`` to the way along the rim from a vertex, as far as it is shorter."""
    count = len(points)
    away[begin] = 0
    waiting[0], head, tail = begin, 0, 1
    queued[begin] = True
    while head != tail:
        v = waiting[head]
        head = head + 1 if head < count else 0
        queued[v] = False
        for e in range(first[v], first[v + 1]):
            u = near[e]
            if not on_rim[u]:
                continue
            dx = points[u, 0] - points[v, 0]
            dy = points[u, 1] - points[v, 1]
            dz = points[u, 2] - points[v, 2]
            there = away[v] + np.sqrt(dx * dx + dy * dy + dz * dz)
            if there < np.float32(0.9999) * away[u]:
                away[u] = there
                if not queued[u]:
                    queued[u] = True
                    waiting[tail] = u
                    tail = tail + 1 if tail < count else 0


@njit(cache=True)
def _set_out(points, first, near, on_rim, wanted, order, apart):
    count = len(points)
    away = np.full(count, np.float32(np.inf))
    waiting = np.empty(count + 1, dtype=np.int32)
    queued = np.zeros(count, dtype=np.bool_)
    found = np.empty(count, dtype=np.int32)
    number = 0
    for begin in order:
        if away[begin] < np.float32(np.inf) or not wanted[begin]:
            continue
        found[number] = begin
        number += 1
        _walk(begin, points, first, near, on_rim, away, waiting, queued)
        while True:
            # The next bead is the nearest place that is far enough from all others.
            best, least = -1, np.float32(np.inf)
            for v in order:
                excess = away[v] / apart[v]
                if excess >= 1 and excess < least:
                    best, least = v, excess
            if best < 0:
                break
            found[number] = best
            number += 1
            _walk(best, points, first, near, on_rim, away, waiting, queued)
    return found[:number].copy(), away
