# SPDX-License-Identifier: GPL-3.0-or-later
"""How near a splash is to the truth."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.ndimage import binary_dilation, binary_erosion
from scipy.spatial import cKDTree


def occupancy_metrics(guess: np.ndarray, truth: np.ndarray, spacing: float) -> dict[str, float]:
    """Return the accuracy of a set of occupied cells, bool ``(X, Y, Z)``.

    iou, tpr, precision, fpr : over all cells. hausdorff_*, hd95_* : greatest and 95th
    percentile of the distances between the centres of both surfaces' cells, both ways, in
    cells and millimetres (NaN where one is empty). f_score : harmonic mean of the shares of
    either surface within one cell of the other. spacing : metres.
    """
    both = float((guess & truth).sum())
    mine, theirs = float(guess.sum()), float(truth.sum())
    result = {
        "iou": iou(guess, truth),
        "tpr": both / max(theirs, 1.0),
        "precision": both / max(mine, 1.0),
        "fpr": (mine - both) / max(truth.size - theirs, 1.0),
    }
    if not (mine and theirs):
        lost = {"hausdorff_cells": np.nan, "hd95_cells": np.nan, "f_score": 0.0}
        return {**result, **lost, "hausdorff_mm": np.nan, "hd95_mm": np.nan}
    a, b = surface_cells(guess), surface_cells(truth)
    there, back = cKDTree(b).query(a)[0], cKDTree(a).query(b)[0]
    hausdorff = float(max(there.max(), back.max()))
    hd95 = float(max(np.percentile(there, 95), np.percentile(back, 95)))
    near = [float((d <= 1.0).mean()) for d in (there, back)]
    result["f_score"] = 2 * near[0] * near[1] / max(sum(near), 1e-9)
    for name, value in (("hausdorff", hausdorff), ("hd95", hd95)):
        result[f"{name}_cells"] = value
        result[f"{name}_mm"] = value * spacing * 1000
    return result


def iou(guess: np.ndarray, truth: np.ndarray) -> float:
    """Return intersection over union of two bool arrays; 0 where both are empty."""
    return float((guess & truth).sum() / max((guess | truth).sum(), 1))


def threshold_ious(
    occupancy: np.ndarray, truth: np.ndarray, thresholds: Iterable[float]
) -> list[float]:
    """Return the IoU of the cells above each threshold with the truth.

    occupancy : ``(X, Y, Z)``, 0..1; truth : bool ``(X, Y, Z)``
    """
    return [iou(occupancy > threshold, truth) for threshold in thresholds]


def surface_cells(occupied: np.ndarray) -> np.ndarray:
    """Return the occupied cells that have an empty neighbour, ``(n, 3)``."""
    return np.argwhere(occupied & ~binary_erosion(occupied))


def velocity_metrics(
    guess: np.ndarray, truth: np.ndarray, occupied: np.ndarray
) -> dict[str, float]:
    """Return the velocity's error over the truly occupied cells dilated by one.

    velocity_error : mean length of the difference over the mean speed. angle_deg : mean angle
    weighted by speed. guess, truth : ``(3, X, Y, Z)``.
    """
    where = binary_dilation(occupied) & truth.any(axis=0)
    u, v = guess[:, where], truth[:, where]
    speed, other = np.linalg.norm(v, axis=0), np.linalg.norm(u, axis=0)
    cosine = (u * v).sum(axis=0) / np.maximum(speed * other, 1e-9)
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    return {
        "velocity_error": float(np.linalg.norm(u - v, axis=0).mean() / max(speed.mean(), 1e-9)),
        "angle_deg": float((angle * speed).sum() / max(speed.sum(), 1e-9)),
    }


def relative_divergence(velocity: np.ndarray, occupied: np.ndarray) -> float:
    """Return how far a flow is from conserving volume: rms(div u) * h / mean speed.

    By central differences over the occupied cells whose six neighbours are occupied too, NaN where
    there are none. A flow that loses all its speed from one cell to the next has about 1.

    velocity : ``(3, X, Y, Z)``; occupied : bool ``(X, Y, Z)``
    """
    inside = np.argwhere(binary_erosion(occupied))
    if not len(inside):
        return float("nan")
    change = np.zeros(len(inside))
    for axis, step in enumerate(np.eye(3, dtype=int)):
        ahead, behind = tuple((inside + step).T), tuple((inside - step).T)
        change += (velocity[axis][ahead] - velocity[axis][behind]) / 2
    speed = np.linalg.norm(velocity[:, *inside.T], axis=0).mean()
    return float(np.sqrt((change**2).mean()) / max(speed, 1e-9))


def average(rows: Sequence[dict[str, float]]) -> dict[str, float]:
    """Return the mean of each figure over the rows that have it; NaN counts as missing."""
    found: dict[str, list[float]] = {name: [] for row in rows for name in row}
    for row in rows:
        for name, value in row.items():
            if not np.isnan(value):
                found[name].append(value)
    return {name: float(np.mean(values)) for name, values in found.items() if values}
