# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth edges where the generator is not sure of them.

No stroke tells where a sheet ends, so the probability of liquid hovers around one half there: the
generator's blocks of 2^3 cells then leave ragged rims and specks that no liquid has.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..compiling import njit
from ..grid import LOCAL_SPACING
from ..numeric.box_filter import mean_around
from ..numeric.threads import in_parts
from .level_set import LevelSet
from .volume import filled_cells, shifted_to_volume

CERTAIN = 1.5
"""Level, in cells, beyond which the generator is sure: odds of e^3, 20 to 1."""

MOVED = 1.0
"""Level, in cells, up to which it is changed: farther out the surface hardly ever moves."""

BLUR, BLUR_CELLS = 1.2, 3
"""Width in cells of the Gaussian that smooths edges, and the cells to each side in its sum."""


def smoothed_edges(liquid: LevelSet) -> LevelSet:
    """Return the liquid with a smooth surface where the generator is not sure of it.

    There the level is blurred, in proportion to the doubt, and shifted so that the volume stays.
    Drafts are left as they are: their cells are as large as the blocks.
    """
    if liquid.grid.spacing > 1.5 * LOCAL_SPACING or liquid.box is None:
        return liquid
    near = np.clip(liquid.level[liquid.box], -CERTAIN, CERTAIN)
    cells = np.argwhere(np.abs(near) < MOVED)
    doubt = np.maximum(1 - mean_around(np.abs(near), cells, 1) / CERTAIN, 0)
    cells, doubt = cells[doubt > 0], doubt[doubt > 0]
    before = near[tuple(cells.T)]
    moved = before + doubt * (blurred_at(near, cells) - before)
    level = liquid.level.copy()
    level[tuple((cells + [side.start for side in liquid.box]).T)] = shifted_to_volume(
        lambda more: moved + doubt * more, filled_cells(before)
    )
    return replace(liquid, level=level)


def blurred_at(level: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return the level at cells ``(n, 3)``, blurred, float32 ``(n,)``: they are few."""
    blurred = np.empty(len(cells), dtype=np.float32)
    taps = np.exp(-0.5 * (np.arange(-BLUR_CELLS, BLUR_CELLS + 1) / BLUR) ** 2).astype(np.float32)
    in_parts(len(cells), lambda a, b: _blur(level, cells[a:b], taps, blurred[a:b]))
    return blurred


@njit(cache=True)
def _blur(level: np.ndarray, cells: np.ndarray, taps: np.ndarray, blurred: np.ndarray) -> None:
    """Set the weighted mean of the level around each cell; outside of the array is none."""
    x, y, z = level.shape
    reach = len(taps) // 2
    for n in range(len(cells)):
        i, j, k = cells[n]
        total, weights = np.float32(0), np.float32(0)
        for a in range(max(i - reach, 0), min(i + reach + 1, x)):
            for b in range(max(j - reach, 0), min(j + reach + 1, y)):
                row = taps[a - i + reach] * taps[b - j + reach]
                for c in range(max(k - reach, 0), min(k + reach + 1, z)):
                    weight = row * taps[c - k + reach]
                    total += weight * level[a, b, c]
                    weights += weight
        blurred[n] = total / weights
