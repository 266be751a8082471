# SPDX-License-Identifier: GPL-3.0-or-later
"""How much the splashes of one sketch differ by seed, and whether all of them follow the sketch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from scipy.ndimage import binary_dilation
from tqdm import tqdm

from ..data.items import Item
from ..data.samples import held_out_sample
from ..learning.thresholds import Answer
from ..measures.metrics import average, iou
from ..measures.shapes import halved, level_of

Row = dict[str, float]


def spread(masks: Sequence[np.ndarray]) -> float:
    """Return the mean of 1 - IoU over all pairs of bool arrays; two empty ones are alike."""
    pairs = combinations(masks, 2)
    return float(np.mean([1 - iou(a, b) if (a | b).any() else 0.0 for a, b in pairs]))


def covered(occupied: np.ndarray, strokes: np.ndarray) -> float:
    """Return the share of the stroke cells that are occupied; bool ``(X, Y, Z)`` both."""
    return float(occupied[strokes].mean()) if strokes.any() else float("nan")


def seeds_row(
    masks: Sequence[np.ndarray], plain: np.ndarray, truth: np.ndarray, strokes: np.ndarray
) -> Row:
    """Return the figures of one frame, all shares.

    masks : liquid of each seed, bool ``(X, Y, Z)``; plain : of latent zero; strokes : the cells
    that strokes cross.
    """
    scores = [iou(mask, truth) for mask in masks]
    exact = [covered(mask, strokes) for mask in masks]
    near = [covered(binary_dilation(mask), strokes) for mask in masks]
    return {
        "spread": spread(masks),
        "iou_zero": iou(plain, truth),
        "iou_best": max(scores),
        "iou_mean": float(np.mean(scores)),
        "best_gain": max(scores) - iou(plain, truth),
        "covered": float(np.mean(exact)),
        "covered_least": min(exact),
        "covered_near": float(np.mean(near)),
        "covered_near_least": min(near),
        "covered_by_truth": covered(truth, strokes),
    }


def frame_rows(
    answer: Answer, latents: Sequence[np.ndarray], item: Item, grids: Sequence[int]
) -> dict[int, Row]:
    """Return the figures of one frame on each grid.

    On a grid with twice the cells of another, ``draft_iou`` is the IoU of both results of one
    seed, mean over seeds, and ``draft_iou_truth`` that of the truth on both grids.
    """
    rows: dict[int, Row] = {}
    drafts: dict[int, list[np.ndarray]] = {}
    for cells in sorted(grids):
        sample, _ = held_out_sample(item, cells)
        truth = sample.distance < 0
        plain = answer.generate(sample.condition, sample.grid).occupancy > 0.5
        splashes = [answer.generate(sample.condition, sample.grid, z) for z in latents]
        masks = [splash.occupancy > 0.5 for splash in splashes]
        rows[cells] = seeds_row(masks, plain, truth, sample.condition.drawn)
        if cells // 2 in drafts:
            *coarse, coarse_truth = drafts[cells // 2]
            pairs = zip(coarse, splashes, strict=True)
            alike = [iou(draft, halved(level_of(splash))) for draft, splash in pairs]
            rows[cells]["draft_iou"] = float(np.mean(alike))
            rows[cells]["draft_iou_truth"] = iou(coarse_truth, halved(sample.distance))
        drafts[cells] = [*masks, truth]
    return rows


def summary(rows: Sequence[Row], twin_ious: Sequence[float]) -> Row:
    """Return the figures over all frames: means, except for the least cover, that of any seed.

    twin_ious : IoU of each frame with its twin, NaN where it has none; where there are any,
    ``spread_over_twin`` says how the seeds differ against how twins do, on the same frames.
    """
    result = average(rows)
    for name in ("covered_least", "covered_near_least"):
        if name in result:
            result[name] = float(np.nanmin([row[name] for row in rows]))
    twin = np.asarray(twin_ious, dtype=float)
    known = ~np.isnan(twin)
    if known.any():
        spreads = np.array([row["spread"] for row in rows])
        result["twin_spread"] = float(1 - twin[known].mean())
        result["spread_over_twin"] = float(spreads[known].mean() / max(result["twin_spread"], 1e-9))
    return {**result, "frames": len(rows)}


def diversity(
    answer: Answer,
    latents: Sequence[np.ndarray],
    items: Sequence[Item],
    grids: Sequence[int],
    twins: Mapping[Item, float],
) -> dict[int, Row]:
    """Return the figures of ``answer`` on each grid over all items, see :func:`summary`.

    twins : IoU of items with their twins, as far as known.
    """
    rows = [
        frame_rows(answer, latents, item, grids)
        for item in tqdm(items, desc=f"{len(latents)} seeds", unit="frame")
    ]
    known = [twins.get(item, float("nan")) for item in items]
    return {cells: summary([row[cells] for row in rows], known) for cells in grids}
