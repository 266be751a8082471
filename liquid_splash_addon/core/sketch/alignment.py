# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether strokes were redrawn, or are the old ones moved, turned, mirrored or resized as a whole.

A similarity, reflections included, is fitted to strokes that still have as many points as before
(Umeyama, IEEE PAMI 13(4), 1991). Some strokes may have been edited, added or deleted meanwhile.
"""

from __future__ import annotations

from collections.abc import Sequence
from difflib import SequenceMatcher

import numpy as np

TOLERANCE = 2e-4
"""Share of the sketch's size by which points may be off: positions are stored in single precision,
and an object's transform is applied in it."""

LEAST_SHARE = 0.5
"""Share of the old strokes that must have moved as one."""

FLAT = 1e-5
"""Share of the largest singular value below which a sketch counts as a line: any turn about it
fits equally well."""

MOST_TRIALS = 16
"""Most strokes that are tried one by one, where not all have moved alike."""


def similarity_between(
    before: Sequence[np.ndarray],
    after: Sequence[np.ndarray],
    guesses: Sequence[np.ndarray] = (),
) -> np.ndarray | None:
    """Return the transform ``(4, 4)`` that has moved a sketch; None where it was redrawn.

    before, after : points of the strokes, ``(n, 3)`` each, in one space
    guesses : transforms ``(4, 4)`` that are taken if they fit, the first of them first: where a
        sketch lies on a line or a plane, several do
    """
    pairs = [(before[i], after[j]) for i, j in same_counts(before, after)]
    least = max(1, int(np.ceil(LEAST_SHARE * len(before))))
    if len(pairs) < least:
        return None
    size = extent([new for _, new in pairs])
    if not size > 0:
        return None
    reference = guesses[0] if guesses else np.eye(4)

    def fitting(matrix: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        return [pair for pair in pairs if misfit(matrix, *pair) < TOLERANCE * size]

    for guess in guesses:
        if is_similarity(guess) and len(fitting(guess)) == len(pairs):
            return guess
    step = max(1, len(pairs) // MOST_TRIALS)
    trials = [pairs, *([pair] for pair in pairs[::step])]
    found = max((fitting(fitted(trial, reference)) for trial in trials), key=len)
    if len(found) < least:
        return None
    matrix = fitted(found, reference)
    return matrix if len(fitting(matrix)) >= least else None


def same_counts(before: Sequence[np.ndarray], after: Sequence[np.ndarray]) -> list[tuple[int, int]]:
    """Return pairs of places of strokes that may be the same: in order, with equal point counts."""
    counts = [len(points) for points in before], [len(points) for points in after]
    blocks = SequenceMatcher(None, *counts, autojunk=False).get_matching_blocks()
    return [(a + k, b + k) for a, b, length in blocks for k in range(length)]


def extent(strokes: Sequence[np.ndarray]) -> float:
    """Return the diagonal of the strokes' box."""
    together = np.concatenate(strokes)
    return float(np.linalg.norm(np.ptp(together, axis=0)))


def misfit(matrix: np.ndarray, old: np.ndarray, new: np.ndarray) -> float:
    """Return how far a transform leaves a stroke's points from where they are: the farthest."""
    moved = old @ matrix[:3, :3].T + matrix[:3, 3]
    return float(np.linalg.norm(moved - new, axis=1).max())


def fitted(pairs: Sequence[tuple[np.ndarray, np.ndarray]], reference: np.ndarray) -> np.ndarray:
    """Return the similarity ``(4, 4)`` that fits the points best, by least squares.

    reference : what decides a turn or reflection that the points leave open, ``(4, 4)``
    """
    old = np.concatenate([pair[0] for pair in pairs]).astype(np.float64)
    new = np.concatenate([pair[1] for pair in pairs]).astype(np.float64)
    middles = old.mean(axis=0), new.mean(axis=0)
    before, after = old - middles[0], new - middles[1]
    size = float(np.sqrt((before**2).sum()))
    scale = float(np.sqrt((after**2).sum())) / max(size, 1e-300)
    product = after.T @ before
    strengths = np.linalg.svd(product, compute_uv=False)
    if strengths[1] <= FLAT * strengths[0]:
        product = product + FLAT * strengths[0] * rotation_of(reference[:3, :3])
    turns = [turn_of(product, sign) for sign in (1.0, -1.0)]
    # A reflection only where it fits clearly better: a flat sketch is its own mirror image.
    errors = [float(((after - scale * before @ turn.T) ** 2).sum()) for turn in turns]
    turn = turns[1] if errors[1] < 0.5 * errors[0] and errors[0] > 1e-10 * size**2 else turns[0]
    result = np.eye(4)
    result[:3, :3] = scale * turn
    result[:3, 3] = middles[1] - scale * turn @ middles[0]
    return result


def turn_of(product: np.ndarray, sign: float) -> np.ndarray:
    """Return the orthogonal matrix of determinant ``sign`` nearest to a matrix ``(3, 3)``."""
    left, _, right = np.linalg.svd(product)
    last = sign * np.linalg.det(left) * np.linalg.det(right)
    return np.asarray(left @ np.diag([1.0, 1.0, np.sign(last)]) @ right)


def rotation_of(matrix: np.ndarray) -> np.ndarray:
    """Return the rotation nearest to a matrix ``(3, 3)``."""
    return turn_of(matrix, 1.0) if np.isfinite(matrix).all() else np.eye(3)


def is_similarity(matrix: np.ndarray, tolerance: float = 1e-4) -> bool:
    """Whether a transform ``(4, 4)`` keeps all angles; it may mirror."""
    linear = matrix[:3, :3]
    if not np.isfinite(matrix).all():
        return False
    size = np.cbrt(abs(np.linalg.det(linear)))
    if not size > 0:
        return False
    return bool(np.abs(linear @ linear.T / size**2 - np.eye(3)).max() <= tolerance)
