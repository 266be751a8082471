# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a splash would break up: points chosen by eq. 4 of the paper."""

from __future__ import annotations

import numpy as np

from ..compiling import njit
from ..liquid.fields import PHI_CELLS
from ..liquid.level_set import LevelSet

FRONT_BAND = 0.4
"""phi_band of Table 2, in units of phi: 1.6 cells."""

LEAST_MEASURE = 1e-3
"""Least Laplacian and curvature that count, in cells: their logarithms stay finite."""

DISTANCE_BLUR = 0.7
"""Cells over which the distance is smoothed before its curvature is taken, so that voxels do not
count as edges."""


def band_cells(liquid: LevelSet, inside: bool) -> np.ndarray:
    """Return the cells ``(n, 3)`` in the band of eq. 4, of the liquid or of the air beside it.

    Cells at the grid's walls are left out, as central differences need both neighbours.
    """
    depth = FRONT_BAND * PHI_CELLS
    if liquid.box is None:
        return np.zeros((0, 3), dtype=np.int64)
    level = liquid.distance[liquid.box]
    chosen = (level <= 0) & (level > -depth) if inside else (level > 0) & (level <= depth)
    cells = np.argwhere(chosen) + [side.start for side in liquid.box]
    return cells[((cells > 0) & (cells < np.array(liquid.level.shape) - 1)).all(axis=1)]


def break_measure(liquid: LevelSet, cells: np.ndarray, alpha: float, beta: float) -> np.ndarray:
    """Return the logarithm of the left side of eq. 4 at ``cells`` ``(n, 3)``, float32 ``(n,)``.

    alpha log |Laplacian u| + beta log |curvature of phi|, both in cells: other units would add the
    same everywhere, and only the order counts.
    """
    from scipy.ndimage import gaussian_filter

    smooth = liquid.distance
    if liquid.box is not None:
        smooth = smooth.copy()
        smooth[liquid.box] = gaussian_filter(smooth[liquid.box], DISTANCE_BLUR)
    turbulence = np.empty(len(cells), dtype=np.float32)
    curvature = np.empty(len(cells), dtype=np.float32)
    _measure(smooth, liquid.velocity, cells, turbulence, curvature)
    return np.asarray(
        alpha * np.log(np.maximum(turbulence, LEAST_MEASURE))
        + beta * np.log(np.maximum(curvature, LEAST_MEASURE))
    )


@njit(cache=True)
def _measure(distance, velocity, cells, turbulence, curvature):
    d = np.empty((3, 3, 3), dtype=np.float32)
    for n in range(len(cells)):
        i, j, k = cells[n, 0], cells[n, 1], cells[n, 2]
        square = 0.0
        for a in range(3):
            u = velocity[a]
            around = u[i - 1, j, k] + u[i + 1, j, k] + u[i, j - 1, k]
            around += u[i, j + 1, k] + u[i, j, k - 1] + u[i, j, k + 1]
            square += (around - 6 * u[i, j, k]) ** 2
        turbulence[n] = np.sqrt(square)
        d[:] = distance[i - 1 : i + 2, j - 1 : j + 2, k - 1 : k + 2]
        curvature[n] = abs(_curvature(d))


@njit(cache=True)
def _curvature(d):
    """Return div(grad d / |grad d|) at the middle of 3^3 cells."""
    x = 0.5 * (d[2, 1, 1] - d[0, 1, 1])
    y = 0.5 * (d[1, 2, 1] - d[1, 0, 1])
    z = 0.5 * (d[1, 1, 2] - d[1, 1, 0])
    here = 2 * d[1, 1, 1]
    xx = d[2, 1, 1] - here + d[0, 1, 1]
    yy = d[1, 2, 1] - here + d[1, 0, 1]
    zz = d[1, 1, 2] - here + d[1, 1, 0]
    xy = 0.25 * (d[2, 2, 1] - d[2, 0, 1] - d[0, 2, 1] + d[0, 0, 1])
    xz = 0.25 * (d[2, 1, 2] - d[2, 1, 0] - d[0, 1, 2] + d[0, 1, 0])
    yz = 0.25 * (d[1, 2, 2] - d[1, 2, 0] - d[1, 0, 2] + d[1, 0, 0])
    top = xx * (y * y + z * z) + yy * (x * x + z * z) + zz * (x * x + y * y)
    top -= 2 * (x * y * xy + x * z * xz + y * z * yz)
    size = max(np.sqrt(x * x + y * y + z * z), 0.1)
    return top / size**3


def choose(
    cells: np.ndarray, measure: np.ndarray, amount: float, apart: float, rng: np.random.Generator
) -> np.ndarray:
    """Return random points ``(m, 3)``, cells, in the cells that :func:`strongest` chooses."""
    points = cells[strongest(cells, measure, amount, apart, rng)]
    return np.asarray(points + rng.random(points.shape), dtype=np.float32)


def strongest(
    cells: np.ndarray, measure: np.ndarray, amount: float, apart: float, rng: np.random.Generator
) -> np.ndarray:
    """Return the numbers ``(m,)`` of stratified random ones of the cells of the greatest measure.

    gamma of eq. 4 is the measure that a share ``amount`` of the cells exceeds. One is drawn in each
    stratum, a cube with an edge of ``apart`` cells, that holds any of them.
    """
    count = round(amount * len(cells))
    if count == 0:
        return np.zeros(0, dtype=np.int64)
    highest = np.argpartition(measure, len(cells) - count)[len(cells) - count :]
    mixed = rng.permutation(highest)
    strata = np.floor(cells[mixed] / apart).astype(np.int64)
    _, first = np.unique(strata @ np.array([1 << 40, 1 << 20, 1]), return_index=True)
    return np.asarray(mixed[np.sort(first)])
