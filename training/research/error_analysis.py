# SPDX-License-Identifier: GPL-3.0-or-later
"""Where answers miss the truth, and what the best of all patches would give.

    python -m training error-analysis DATA

Liquid that an answer has beside the truth is misplaced, what it has far from it is made up; true
liquid far from the answer was not found. IoUs are also given by the distance from the strokes: in
cells that strokes cross, only how the liquid lies about them has to be guessed. And the IoU of the
patches between the strokes: all of them, those that lie in liquid, and those moved to the middle of
the nearest liquid. No patch classifier can do better than the last two.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from scipy.ndimage import map_coordinates
from tqdm import tqdm

from liquid_splash_addon.core.condition.patches.gabriel import find_patches, sample_points_of
from liquid_splash_addon.core.condition.patches.sampling import sample_patches
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.sketch.local_frame import fit_frame
from liquid_splash_addon.core.sketch.strokes import Stroke

from ..command_line import command_parser
from ..data.samples import held_out_sample
from ..evaluation.answers import chosen, read_arguments, stroke_counts
from ..evaluation.baselines import distance_to
from ..measures.metrics import average, iou

MISS_BOUNDS = (1.0, 2.0, 4.0)
"""Bounds, in cells, by which misses are told apart; beyond the last they are far."""

STROKE_BOUNDS = (0.5, 1.5, 3.0, 5.0, 8.0, 12.0)
"""Bounds, in cells, of the distances from strokes by which IoUs are told apart."""

SEARCH_REACH = 8.0
"""Cells to either side along its normal in which liquid is sought from a sample of a patch."""

SEARCH_STEP = 0.5
"""Cells from one place that is looked at to the next."""

PATCH_THICKNESS = 1.0
"""Cells around patches that are taken to be liquid."""


def missed_and_added(guess: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """Return shares of the true volume: found, and missed and added by how far off.

    'missed_1' lies within a cell of the guess, 'missed_2' within two but not one, ...,
    'missed_far' beyond; 'added_...' likewise by distance from the truth. bool ``(X, Y, Z)``
    """
    volume = max(float(truth.sum()), 1.0)
    shares = {"iou": iou(guess, truth), "found": float((guess & truth).sum() / volume)}
    for name, cells, other in (("missed", truth & ~guess, guess), ("added", guess & ~truth, truth)):
        off = distance_to(other)[cells] if other.any() else np.full(cells.sum(), np.inf)
        counts = np.histogram(off, [0.0, *(n + 0.01 for n in MISS_BOUNDS), np.inf])[0] / volume
        for place, share in zip([*(f"{n:.0f}" for n in MISS_BOUNDS), "far"], counts, strict=True):
            shares[f"{name}_{place}"] = float(share)
    return shares


def by_distance(guess: np.ndarray, truth: np.ndarray, drawn: np.ndarray) -> dict[str, float]:
    """Return IoU and share of the true volume by distance from the strokes.

    'iou_to_0.5' is of the cells that strokes cross, 'iou_to_1.5' of those beyond up to 1.5 cells
    away, ..., 'iou_beyond' of the rest; NaN where there is no liquid. bool ``(X, Y, Z)``
    """
    groups = np.digitize(distance_to(drawn), STROKE_BOUNDS, right=True)
    shares = {}
    for number, name in enumerate([*(f"to_{bound:g}" for bound in STROKE_BOUNDS), "beyond"]):
        mine, theirs = guess & (groups == number), truth & (groups == number)
        shares[f"iou_{name}"] = iou(mine, theirs) if (mine | theirs).any() else np.nan
        shares[f"truth_{name}"] = float(theirs.sum() / max(truth.sum(), 1))
    return shares


def to_the_middle(distance: np.ndarray, where: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return how far along its normal each place is from the middle of the nearest liquid, cells.

    NaN where there is none within SEARCH_REACH. distance : ``(X, Y, Z)``, negative in liquid;
    where : ``(n, 3)``, cell coordinates; normals : ``(n, 3)``.
    """
    steps = np.arange(-SEARCH_REACH, SEARCH_REACH + SEARCH_STEP, SEARCH_STEP)
    looks = (where[:, None] + steps[:, None] * normals[:, None]).reshape(-1, 3).T - 0.5
    wet = map_coordinates(distance, looks, order=1, mode="nearest").reshape(-1, len(steps)) < 0
    nearest = np.where(wet, np.abs(steps), np.inf).argmin(axis=1)
    ends = []
    for way in (-1, 1):
        end, going = nearest.copy(), wet.any(axis=1)
        while going.any():
            further = np.clip(end + way, 0, len(steps) - 1)
            going = going & (further != end) & wet[np.arange(len(end)), further]
            end = np.where(going, further, end)
        ends.append(steps[end])
    return np.where(wet.any(axis=1), np.mean(ends, axis=0), np.nan)


def patches_at_best(
    strokes: Sequence[Stroke], distance: np.ndarray, grid: Grid
) -> dict[str, float]:
    """Return the IoU of thick patches: all, those in liquid, those moved into its middle.

    strokes : in local metres; distance : the truth on ``grid``, cells.
    """
    sample_points = sample_points_of(strokes)
    patches = find_patches(sample_points)
    points, values = sample_patches(sample_points, patches, patches.faces)
    where, normals = grid.to_cells(points), values[:, :3].astype(np.float64)
    wet = map_coordinates(distance, where.T - 0.5, order=1, mode="nearest") < 0
    middle = to_the_middle(distance, where, normals)
    near = np.isfinite(middle)
    moved = where[near] + middle[near, None] * normals[near]
    drawn = grid.to_cells(sample_points.points)
    kinds = {"patches": where, "patches_in_liquid": where[wet], "patches_moved": moved}
    return {
        name: iou(distance_to(marked(grid, drawn, places)) <= PATCH_THICKNESS, distance < 0)
        for name, places in kinds.items()
    }


def marked(grid: Grid, *places: np.ndarray) -> np.ndarray:
    """Return the cells that hold any of the places, given in cell coordinates ``(n, 3)``."""
    cells = np.zeros(grid.shape, dtype=bool)
    for coordinates in places:
        whole = np.floor(coordinates).astype(int)
        inside = ((whole >= 0) & (whole < grid.shape)).all(axis=1)
        cells[tuple(whole[inside].T)] = True
    return cells


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    args = read_arguments(command_parser("error-analysis", __doc__), arguments, most=40)
    try:
        items, answer = chosen(args)
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    rows = []
    for item in tqdm(items, unit="frame", leave=False):
        sample, strokes = held_out_sample(item, args.cells, stroke_counts(args))
        guess = answer.generate(sample.condition, sample.grid).occupancy > 0.5
        local = fit_frame(strokes).strokes_to_local(strokes)
        truth = sample.distance < 0
        rows.append(missed_and_added(guess, truth))
        rows.append(by_distance(guess, truth, sample.condition.drawn))
        rows.append(patches_at_best(local, sample.distance, sample.grid))
    for name, value in average(rows).items():
        print(f"{name:18} {value:.3f}")
    return 0
