# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of speeds, for strokes that are being drawn."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

FAST = 2.0
"""Speed of the hand, m/s, at the end of the colours; one in a hundred moves is faster."""

RAMP = (
    (0.10, 0.25, 0.90),
    (0.10, 0.80, 0.85),
    (0.20, 0.85, 0.25),
    (0.98, 0.85, 0.15),
    (0.95, 0.15, 0.10),
)
"""Linear RGB from rest to FAST, evenly: blue, cyan, green, yellow, red."""


LEVELS = 8
"""Colours that strokes are shown in where each piece of one has a single colour."""


def level_colours() -> np.ndarray:
    """Return the colour of each level, float32 ``(LEVELS, 4)`` RGBA."""
    return colours_of(FAST * (np.arange(LEVELS) + 0.5) / LEVELS)


def pieces_of(speeds: np.ndarray) -> list[tuple[int, int, int]]:
    """Cut a stroke into pieces of one level: (first point, last point, level).

    Pieces meet at a point. speeds : of the hand at each point, ``(n,)``, n > 1, metres per second.
    """
    between = (speeds[1:] + speeds[:-1]) / 2
    levels = np.clip(between / FAST * LEVELS, 0, LEVELS - 1).astype(int)
    cuts = [0, *(np.flatnonzero(np.diff(levels)) + 1).tolist(), len(levels)]
    return [(first, last, int(levels[first])) for first, last in pairwise(cuts)]


def colours_of(speeds: np.ndarray) -> np.ndarray:
    """Return RGBA, float32 ``(n, 4)``, of speeds of the hand ``(n,)`` in metres per second."""
    share = np.clip(np.asarray(speeds, dtype=np.float64) / FAST, 0.0, 1.0)
    stops = np.linspace(0.0, 1.0, len(RAMP))
    columns = [np.interp(share, stops, [colour[axis] for colour in RAMP]) for axis in range(3)]
    return np.stack([*columns, np.ones_like(share)], axis=-1).astype(np.float32)
