# SPDX-License-Identifier: GPL-3.0-or-later
"""From the figures of single frames to means, groups, standard errors, tables and a file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..data.items import Item, scenes_digest
from ..measures.metrics import average

Figures = dict[str, dict[str, Any]]
"""Figures by the model's name; groups and diversity are dictionaries in them."""

STROKE_GROUPS = {"5-8": (5, 9), "9-12": (9, 13), "13-16": (13, 17), "17-20": (17, 21)}
"""Groups by the number of strokes, from the first to below the second."""

TIME_GROUPS = {
    "50-75 ms": (0.05, 0.075),
    "75-100 ms": (0.075, 0.1),
    "100-150 ms": (0.1, 0.15),
    "150-200 ms": (0.15, 0.2),
    "200-500 ms": (0.2, 0.501),
}
"""Groups by seconds since impact."""

COLUMNS = ("iou", "iou_se", "iou_over_twin", "tpr", "precision", "fpr", "f_score", "hausdorff_mm",
           "hd95_mm", "hausdorff_cells", "hd95_cells", "velocity_error", "angle_deg",
           "divergence", "roughness_deg", "roughness_over_truth", "thickness_cells",
           "thickness_over_truth")  # fmt: skip

DIVERSITY_COLUMNS = ("spread", "spread_over_twin", "iou_zero", "iou_mean", "iou_best", "best_gain",
                     "covered", "covered_least", "covered_near", "covered_near_least",
                     "covered_by_truth", "draft_iou", "draft_iou_truth")  # fmt: skip


def grouped(
    values: Sequence[float], keys: Sequence[float], groups: Mapping[str, tuple[float, float]]
) -> dict[str, dict[str, float]]:
    """Return mean IoU and number of frames of each group that has any.

    values : IoU of each frame; keys : what decides its group.
    """
    result = {}
    for name, (low, high) in groups.items():
        part = [v for v, key in zip(values, keys, strict=True) if low <= key < high]
        if part:
            result[name] = {"iou": float(np.mean(part)), "frames": len(part)}
    return result


def standard_error(values: Sequence[float], scenes: Sequence[int]) -> float:
    """Return the standard error of the mean of ``values``; NaN for less than two scenes.

    Frames of a scene are alike, so scenes are what was drawn at random: the error is that of a
    mean over clusters, which for scenes with equally many frames is that of the scenes' means.
    """
    away = np.asarray(values) - np.mean(values)
    _, place = np.unique(scenes, return_inverse=True)
    sums = np.bincount(place, away)
    count = len(sums)
    if count < 2:
        return float("nan")
    return float(np.sqrt(count / (count - 1) * (sums**2).sum()) / len(away))


def summary(
    rows: Sequence[dict[str, float]],
    items: Sequence[Item],
    strokes: Sequence[int],
    twins: Mapping[Item, float],
) -> dict[str, Any]:
    """Return the figures of one model: means, error, against the twins, groups.

    rows : figures of each of ``items``; strokes : of each sketch; twins : IoU of items with
    their twins, as far as known.
    """
    result: dict[str, Any] = average(rows)
    values = [row["iou"] for row in rows]
    error = standard_error(values, [item.seed for item in items])
    if not np.isnan(error):
        result["iou_se"] = error
    known = [(row["iou"], twins[item]) for row, item in zip(rows, items, strict=True)
             if item in twins]  # fmt: skip
    if known:
        mine, theirs = np.mean(known, axis=0)
        result |= {"twin_iou": float(theirs), "iou_over_twin": float(mine / max(theirs, 1e-9)),
                   "twin_frames": len(known)}  # fmt: skip
    result["by_strokes"] = grouped(values, strokes, STROKE_GROUPS)
    result["by_time"] = grouped(values, [item.time for item in items], TIME_GROUPS)
    return result


def load_twins(path: Path, items: Sequence[Item]) -> dict[Item, float]:
    """Return each item's IoU with its twin, as far as a file of the command ceiling has it.

    Raises ValueError for a file that is not of these frames.
    """
    try:
        rows = json.loads(path.read_text())
        known = {(row["seed"], row["number"]): row for row in rows}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path} is no file of `python -m training ceiling --data`") from error
    result = {}
    for item in items:
        row = known.get((item.seed, item.number))
        if row is not None:
            if abs(row["time"] - item.time) > 1e-6:
                raise ValueError(
                    f"{path} is of other data: run `python -m training ceiling --data` again"
                )
            result[item] = float(row["iou"])
    return result


def frames_hash(items: Sequence[Item]) -> str:
    """Return a hash of the frames: their files' content and their numbers."""
    digest = scenes_digest(items)
    digest.update(json.dumps([(item.seed, item.number) for item in items]).encode())
    return digest.hexdigest()


def load_kept(path: Path, test_hash: str) -> dict[str, Any]:
    """Return what an earlier run wrote, nothing where there is no file.

    Raises ValueError if it is of other test frames: its rows are not comparable with new ones.
    """
    if not path.exists():
        return {}
    kept = dict(json.loads(path.read_text()))
    if kept.get("about", {}).get("test_hash") != test_hash:
        raise ValueError(f"{path} has figures of other test frames: leave out --keep")
    return kept


def merged(kept: dict[str, Any], new: dict[str, Any], measured: Sequence[str]) -> dict[str, Any]:
    """Return old and new results together; of the models in ``measured`` only the new."""
    result: dict[str, Any] = {"about": merged_about(kept.get("about", {}), new["about"])}
    for grid in [*new, *kept]:
        if grid not in result:
            old = kept.get(grid, {})
            rows = {name: row for name, row in old.items() if name not in measured}
            result[grid] = {**rows, **new.get(grid, {})}
    return result


def merged_about(kept: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """Return both dictionaries merged, and those in them too; the new one takes precedence."""
    inner = {name: {**kept.get(name, {}), **value} for name, value in new.items()
             if isinstance(value, dict)}  # fmt: skip
    return {**kept, **new, **inner}


def cell(row: Mapping[str, Any], name: str) -> str:
    """Return one figure as text, '-' where there is none."""
    return f"{row[name]:.4f}" if name == "fpr" and name in row else (
        f"{row[name]:.3f}" if name in row else "-"
    )  # fmt: skip


def table(results: Mapping[str, Figures], columns: Sequence[str] = COLUMNS) -> str:
    """Return the figures as a Markdown table, without columns that no row has."""
    rows = [(f"{grid}^3", name, row) for grid, figures in results.items()
            for name, row in figures.items()]  # fmt: skip
    shown = [c for c in columns if any(c in row for _, _, row in rows)]
    lines = ["| grid | model | " + " | ".join(shown) + " |", "|---" * (len(shown) + 2) + "|"]
    for grid, name, row in rows:
        lines.append(f"| {grid} | {name} | " + " | ".join(cell(row, c) for c in shown) + " |")
    return "\n".join(lines)


def group_table(results: Mapping[str, Figures], key: str, groups: Mapping[str, Any]) -> str:
    """Return mean IoU by group, frames in brackets, as a Markdown table."""
    lines = ["| grid | model | " + " | ".join(groups) + " |", "|---" * (len(groups) + 2) + "|"]
    for grid, figures in results.items():
        for name, row in figures.items():
            found = row.get(key, {})
            cells = [f"{found[g]['iou']:.3f} ({found[g]['frames']})" if g in found else "-"
                     for g in groups]  # fmt: skip
            lines.append(f"| {grid}^3 | {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def describe(results: Mapping[str, Figures]) -> str:
    """Return all tables."""
    parts = [table(results)]
    parts += ["IoU by strokes", group_table(results, "by_strokes", STROKE_GROUPS)]
    parts += ["IoU by time since impact", group_table(results, "by_time", TIME_GROUPS)]
    varied = {
        grid: {name: row["diversity"] for name, row in figures.items() if "diversity" in row}
        for grid, figures in results.items()
    }
    if any(varied.values()):
        parts += ["Several seeds", table(varied, DIVERSITY_COLUMNS)]
    return "\n\n".join(parts)
