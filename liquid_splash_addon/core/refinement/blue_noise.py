# SPDX-License-Identifier: GPL-3.0-or-later
"""Blue-noise points in a ball by dart throwing (Cook 1986)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..compiling import njit

LEAST_GAP = 0.75
"""Least distance of two points over the edge of the cube that each represents: darts still find
free places, and no two particles begin on top of each other."""

PATTERNS = 8
"""Different balls for each count; every use is rotated at random."""


@lru_cache(maxsize=512)
def ball(count: int, pattern: int) -> np.ndarray:
    """Return ``count`` points in the unit ball, float32 ``(count, 3)``.

    pattern : which of the PATTERNS balls of this count.
    """
    points = np.empty((count, 3), dtype=np.float32)
    spacing = (4 / 3 * np.pi / count) ** (1 / 3)
    _throw(points, np.float32(LEAST_GAP * spacing), np.random.default_rng(pattern % PATTERNS))
    return points


def balls_around(
    points: np.ndarray, radii: np.ndarray, counts: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return particles that fill a ball around each of ``points`` ``(m, 3)``.

    radii, counts : ``(m,)``, of the balls, and their particles. Returns positions, float32
    ``(n, 3)``, spacing, float32 ``(n,)``, the edge of the cube that each represents, and group,
    int32 ``(n,)``, the number of its ball.
    """
    parts = [np.zeros((0, 3))]
    parts += [
        ball(int(count), int(rng.integers(PATTERNS))) @ random_turn(rng) * radius + point
        for point, radius, count in zip(points, radii, counts, strict=True)
    ]
    group = np.repeat(np.arange(len(points), dtype=np.int32), counts)
    spacing = (radii * (4 / 3 * np.pi / counts) ** (1 / 3)).astype(np.float32)
    return np.concatenate(parts).astype(np.float32), spacing[group], group


@njit(cache=True)
def _throw(points, apart, rng):
    placed, missed = 0, 0
    while placed < len(points):
        x = rng.uniform(-1, 1)
        y = rng.uniform(-1, 1)
        z = rng.uniform(-1, 1)
        if x * x + y * y + z * z > 1:
            continue
        free = True
        for p in range(placed):
            a, b, c = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
            if a * a + b * b + c * c < apart * apart:
                free = False
                break
        if free:
            points[placed, 0], points[placed, 1], points[placed, 2] = x, y, z
            placed, missed = placed + 1, 0
        else:
            missed += 1
            if missed > 20000:  # an unlucky start left no place: allow a little closer
                apart *= 0.95
                missed = 0


def random_turn(rng: np.random.Generator) -> np.ndarray:
    """Return a rotation matrix ``(3, 3)``, uniformly distributed (Shoemake 1992)."""
    w, x, y, z = (q := rng.normal(size=4)) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ],
        dtype=np.float32,
    )
