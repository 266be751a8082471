# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrowheads along strokes: which way they flow."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .drawing import segment_directions
from .strokes import arc_length

EVERY = 6.0
"""Arrowheads lie this many of their lengths apart; the last one is at the end of the stroke."""

SPREAD = 0.4
"""Half the width of an arrowhead over its length."""


class Arrows(NamedTuple):
    """Arrowheads as line segments, four each: two in either of two planes across each other.

    segments : float64 ``(m, 4, 2, 3)``, each from the tip back; nearest : int ``(m,)``, number of
    the point that each is nearest to
    """

    segments: np.ndarray
    nearest: np.ndarray


def arrowheads(points: np.ndarray, size: float) -> Arrows:
    """Return the arrowheads of a polyline ``(n, 3)`` that has some length.

    size : length of an arrowhead, in the unit of the points
    """
    along = arc_length(points)
    places = along[-1] - EVERY * size * np.arange(max(int(along[-1] / (EVERY * size)), 1))
    tips = np.stack([np.interp(places, along, axis) for axis in points.T], axis=1)
    nearest = np.clip(np.searchsorted(along, places), 0, len(points) - 1)
    ahead = segment_directions(points)[nearest]
    # Any two directions across the stroke.
    helper = np.eye(3)[np.abs(ahead).argmin(axis=1)]
    across = np.cross(ahead, helper)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    other = np.cross(ahead, across)
    sides = np.stack([across, -across, other, -other], axis=1)
    backs = tips[:, None] - size * (ahead[:, None] - SPREAD * sides)
    segments = np.stack([np.broadcast_to(tips[:, None], backs.shape), backs], axis=2)
    return Arrows(segments, nearest)
