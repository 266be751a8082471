# SPDX-License-Identifier: GPL-3.0-or-later
"""A sheet of pictures: strokes, truth, and what each model makes of the strokes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import affine_transform
from tqdm import tqdm

from liquid_splash_addon.core.grid import LOCAL_SPACING, Grid
from liquid_splash_addon.core.liquid.fields import AIR
from liquid_splash_addon.core.sketch.local_frame import fit_frame

from ..data.items import Item
from ..data.samples import held_out_sample
from ..figures.picture import camera_axes, contact_sheet, draw_liquid, safe_distance, titled
from ..learning.thresholds import Answer
from ..measures.metrics import iou

DRAWN_CELLS = 168
"""Cells along each side of what is drawn: a turned box of 0.4 m without its corners."""

VIEW_WIDTH = 1.25
"""Side of a picture over the width of the true liquid."""


class View(NamedTuple):
    """What a picture shows: centre ``(3,)`` and width, in cells of the drawn array."""

    centre: np.ndarray
    width: float


def upright(distance: np.ndarray, grid: Grid, axes: np.ndarray) -> np.ndarray:
    """Return a signed distance as it stands in the scene, z up, float32 ``(n, n, n)``.

    distance : ``(X, Y, Z)`` in cells of ``grid``, in the local frame with these axes (rows);
    n : DRAWN_CELLS.
    """
    step = LOCAL_SPACING / grid.spacing
    first = axes @ np.full(3, (0.5 - DRAWN_CELLS / 2) * LOCAL_SPACING)
    turned = affine_transform(
        distance,
        axes * step,
        grid.to_cells(first) - 0.5,
        output_shape=(DRAWN_CELLS,) * 3,
        order=1,
        cval=AIR,
    )
    return np.clip(turned / step, -AIR, AIR).astype(np.float32)


def view_of(distance: np.ndarray) -> View:
    """Return the view that shows all of a liquid, VIEW_WIDTH times as wide."""
    cells = np.argwhere(distance < 0) + 0.5
    axes = camera_axes()
    seen = cells @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    return View((low + high) / 2 @ axes, VIEW_WIDTH * float((high - low)[:2].max()))


def draw(distance: np.ndarray, view: View, pixels: int) -> Any:
    """Return a picture of a liquid; only the part of the array that holds some is traced."""
    near = np.argwhere(distance < AIR - 0.5)
    if not len(near):
        return draw_liquid(distance, pixels, centre=view.centre, width=view.width)
    low, high = near.min(axis=0), near.max(axis=0) + 1
    part = distance[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
    return draw_liquid(part, pixels, centre=view.centre - low, width=view.width)


def answered(answer: Answer, item: Item, grids: Sequence[int]) -> tuple[np.ndarray, Grid, float]:
    """Return distance, grid and IoU on the finest of the grids that the model can answer on."""
    for cells in sorted(grids, reverse=True):
        sample, _ = held_out_sample(item, cells)
        try:
            fields = answer.generate(sample.condition, sample.grid)
        except ValueError:
            if cells == min(grids):
                raise
            continue
        return safe_distance(fields), sample.grid, iou(fields.occupancy > 0.5, sample.distance < 0)
    raise ValueError("no grid to draw on")


def draw_row(
    answers: Mapping[str, Answer], item: Item, grids: Sequence[int], pixels: int
) -> list[Any]:
    """Return the pictures of one frame: strokes, truth, then one of each model."""
    finest = max(grids)
    sample, strokes = held_out_sample(item, finest)
    frame = fit_frame(strokes)
    truth = upright(sample.distance, sample.grid, frame.axes)
    view = view_of(truth)
    lines = [(s.points - frame.centre) / LOCAL_SPACING + DRAWN_CELLS / 2 for s in strokes]
    nothing = np.full((2, 2, 2), AIR, dtype=np.float32)
    title = f"scene {item.seed}, {item.time * 1e3:.0f} ms, {len(strokes)} strokes"
    row = [
        titled(draw_liquid(nothing, pixels, strokes=lines, **view._asdict()), title),
        titled(draw(truth, view, pixels), "truth"),
    ]
    for name, answer in answers.items():
        distance, grid, score = answered(answer, item, grids)
        picture = draw(upright(distance, grid, frame.axes), view, pixels)
        coarser = "" if grid.shape[0] == finest else f" at {grid.shape[0]}^3"
        row.append(titled(picture, f"{name}{coarser}: IoU {score:.2f}"))
    return row


def draw_comparison(
    answers: Mapping[str, Answer], items: Sequence[Item], grids: Sequence[int], pixels: int
) -> Any:
    """Return a sheet with a row for each item; the models are drawn on the finest grid they can."""
    pictures = []
    for item in tqdm(items, desc="pictures", leave=False):
        pictures += draw_row(answers, item, grids, pixels)
    return contact_sheet(pictures, 2 + len(answers))
