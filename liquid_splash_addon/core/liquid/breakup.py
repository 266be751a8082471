# SPDX-License-Identifier: GPL-3.0-or-later
"""Thin liquid that has flown for long is broken up by surface tension.

The slower a splash is drawn, the longer its liquid is in flight, and thin features do not last
(paper, Fig. 7). The simulated liquid that generators learn from shows none of this: its cells are
too coarse for surface tension. Here a disturbance grows as on a liquid thread (Rayleigh 1878),
until the thread, or the sheet, has parted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..compiling import njit
from ..fluid.surface_tension import WATER
from ..grid import LOCAL_SPACING
from ..numeric.box_filter import mean_around
from ..numeric.gradient import unit_gradient
from ..numeric.threads import in_parts
from ..settings import SplashSettings
from ..sketch.strokes import Stroke, arc_length, resample
from .fields import AIR
from .level_set import LevelSet
from .volume import filled_cells, shifted_to_volume

GROWTH = 0.343
"""Rate at which the fastest disturbance of a thread of radius a grows, times
sqrt(rho a^3 / sigma) (Rayleigh 1878)."""

WAVENUMBER = 1.45
"""Of the disturbances, times half the liquid's thickness. A thread's fastest has 0.697, but real
liquid is thinner than cells show: with that, all gathers in drops as thick as the sheet is wide,
and what has parted has less surface than before."""

DISTURBANCE = 0.1
"""Size of the first disturbance over half the liquid's thickness: a splash is no quiet jet."""

SLIGHT, GROWTH_MOST = 0.25, 5.0
"""Sizes over half the thickness up to which a grown disturbance does not matter, and beyond
which it grows no more: all has parted by then."""

SWELLING = 2.0
"""Most by which liquid is thicker where it gathers, over half its thickness: a drop out of a
thread has 1.9 times its radius, one out of a sheet three times."""

FLIGHT = 0.25
"""Longest path in metres that liquid is taken to have flown; a pen may go on for longer."""

SLOWEST = 0.05
"""m/s, the least speed of flight: a resting pen says nothing about when the liquid was there."""

BANDS = LOCAL_SPACING * 1.5 ** np.arange(4)
"""Half thicknesses in metres, each with a disturbance of its own; in between they are mixed."""

WAVES, LENGTHS = 20, (0.85, 1.15)
"""Plane waves in each, and the range of their wavenumbers over the fastest's."""

NEAREST_POINTS = 4
"""Points of strokes, the nearest ones, that tell how long liquid has flown."""

THICKNESS_WINDOW = 2
"""Cells to each side in which the liquid's thickness is sought."""

ROUNDING_BLUR = 1.0
"""Width in cells of the blur by which edges and necks become round."""


def broken_up(
    liquid: LevelSet, strokes: Sequence[Stroke], settings: SplashSettings, tension: float = 1.0
) -> LevelSet:
    """Return the liquid after surface tension has acted for as long as it has flown.

    strokes : in local metres and m/s, from where the liquid comes from to where it goes;
    settings : Breakup is the surface tension over water's, Seed and Variation choose where it
    parts; tension : factor on that, of a model of the liquid. The volume stays, to a few
    hundredths.
    """
    points, ages = flown(strokes)
    rate = GROWTH * np.sqrt(settings.breakup * tension * WATER)
    if not len(ages) or growth(rate, ages.max(), BANDS[0]) == 0:
        return liquid
    cells, half = half_thickness(liquid.distance)
    half = np.maximum(half * liquid.grid.spacing, BANDS[0])
    thin = growth(rate, ages.max(), half) > 0  # so ages are asked for where they matter only
    cells, half = cells[thin], half[thin]
    metres = liquid.grid.to_metres(cells + 0.5)
    size = growth(rate, ages_at(metres, points, ages), half)
    parting = size > 0
    if not parting.any():
        return liquid
    cells, half, size = cells[parting], half[parting], size[parting]
    waves = disturbance(middle(liquid, cells, half), half, settings.seed, settings.variation)
    level = liquid.level.copy()
    level[tuple(cells.T)] = parted(liquid, cells, half / liquid.grid.spacing, size, waves)
    return replace(liquid, level=level)


def flown(strokes: Sequence[Stroke]) -> tuple[np.ndarray, np.ndarray]:
    """Return points along the strokes ``(n, 3)``, metres, and for how long liquid there has flown.

    That is, in seconds ``(n,)``, since it left the stroke's beginning, or for FLIGHT metres at
    the speed there, whichever is less.
    """
    points, ages = [np.zeros((0, 3))], [np.zeros(0)]
    for stroke in strokes:
        dense = resample(stroke, LOCAL_SPACING)
        speed = np.linalg.norm(dense.velocities.astype(np.float64), axis=1)
        pace = 1 / np.maximum(speed, SLOWEST)
        steps = np.diff(arc_length(dense.points))
        since = np.concatenate([[0.0], np.cumsum(steps * (pace[1:] + pace[:-1]) / 2)])
        points.append(dense.points)
        ages.append(np.minimum(since, FLIGHT * pace))
    return np.concatenate(points), np.concatenate(ages)


def growth(rate: float, ages: np.ndarray | float, half: np.ndarray | float) -> np.ndarray:
    """Return the size of the disturbance over half the thickness, beyond what is SLIGHT.

    rate : GROWTH sqrt(sigma / rho), m^1.5/s; ages : seconds; half : of the thickness, metres.
    """
    exponent = np.minimum(rate * np.asarray(ages) / np.asarray(half) ** 1.5, 10.0)
    return np.clip(DISTURBANCE * np.expm1(exponent) - SLIGHT, 0.0, GROWTH_MOST)


def half_thickness(distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the cells ``(n, 3)`` nearer to liquid than AIR, and half its thickness there ``(n,)``.

    distance : signed, cells ``(X, Y, Z)``. The depth of the deepest cell near, and a quarter:
    the middle of a sheet lies up to half a cell from one. In cells, at most AIR and a quarter.
    """
    cells = np.argwhere(distance < AIR - 0.01)
    deepest = np.full(distance.shape, -1, dtype=np.float32)  # below 0: no liquid
    in_parts(len(cells), lambda begin, end: _deepest(distance, cells[begin:end], deepest))
    # NaN where no liquid is near: there no disturbance grows.
    half = mean_around(deepest, cells, THICKNESS_WINDOW)
    return cells, np.where(np.isnan(half), AIR, half) + np.float32(0.25)


@njit(cache=True)
def _deepest(distance: np.ndarray, cells: np.ndarray, deepest: np.ndarray) -> None:
    """Set, in the liquid, the depth of the deepest cell within THICKNESS_WINDOW."""
    x, y, z = distance.shape
    for n in range(len(cells)):
        i, j, k = cells[n]
        if distance[i, j, k] >= 0:
            continue
        least = np.float32(0)
        for a in range(max(i - THICKNESS_WINDOW, 0), min(i + THICKNESS_WINDOW + 1, x)):
            for b in range(max(j - THICKNESS_WINDOW, 0), min(j + THICKNESS_WINDOW + 1, y)):
                for c in range(max(k - THICKNESS_WINDOW, 0), min(k + THICKNESS_WINDOW + 1, z)):
                    least = min(least, distance[a, b, c])
        deepest[i, j, k] = -least


def ages_at(metres: np.ndarray, points: np.ndarray, ages: np.ndarray) -> np.ndarray:
    """Return for how long liquid at ``metres`` ``(n, 3)`` has flown, seconds ``(n,)``.

    A mean over the nearest points of strokes, see :func:`flown`, the nearer the more.
    """
    from scipy.spatial import cKDTree

    count = min(NEAREST_POINTS, len(points))
    away, nearest = cKDTree(points).query(metres, k=[*range(1, count + 1)], workers=-1)
    weights = (away + LOCAL_SPACING) ** -2
    return np.asarray((weights * ages[nearest]).sum(axis=1) / weights.sum(axis=1))


def middle(liquid: LevelSet, cells: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Return where the middle of the liquid is, as seen from ``cells`` ``(n, 3)``, metres.

    half : of its thickness, metres. A disturbance goes through all of it.
    """
    spacing = liquid.grid.spacing
    inner = np.clip(cells, 1, np.array(liquid.level.shape) - 2)
    depth = half / spacing + liquid.distance[tuple(cells.T)]
    return np.asarray(
        liquid.grid.to_metres(cells + 0.5 - unit_gradient(liquid.distance, inner) * depth[:, None])
    )


def disturbance(metres: np.ndarray, half: np.ndarray, seed: int, variation: float) -> np.ndarray:
    """Return the disturbance at ``metres`` ``(n, 3)``, of mean square 1, float32 ``(n,)``.

    Plane waves of random directions whose length is that of the fastest growth at each ``half``
    thickness ``(n,)``, metres. The same on grids of any spacing. seed, variation : each seed's
    waves lie elsewhere, by as much as the variation, 0..1, allows.
    """
    own, apart = np.random.default_rng(0), np.random.default_rng(seed)
    height = np.zeros(len(metres), dtype=np.float32)
    square = np.zeros(len(metres), dtype=np.float32)
    steps = np.log(half / BANDS[0]) / np.log(BANDS[1] / BANDS[0])
    for number, size in enumerate(BANDS):
        share = np.clip(1 - np.abs(np.clip(steps, 0, len(BANDS) - 1) - number), 0, 1)
        directions = own.normal(size=(3, WAVES))
        directions /= np.linalg.norm(directions, axis=0)
        vectors = directions * WAVENUMBER / size * own.uniform(*LENGTHS, WAVES)
        phases = own.uniform(0, 2 * np.pi, WAVES)
        phases += variation * apart.uniform(0, 2 * np.pi, WAVES)
        met = np.flatnonzero(share)
        angle = (metres[met] @ vectors + phases).astype(np.float32)
        height[met] += share[met] * np.cos(angle).sum(axis=1) * np.sqrt(2 / WAVES)
        square[met] += share[met] ** 2
    return height / np.sqrt(square)


def parted(
    liquid: LevelSet, cells: np.ndarray, half: np.ndarray, size: np.ndarray, waves: np.ndarray
) -> np.ndarray:
    """Return the level, in cells, at ``cells`` ``(n, 3)``, with the disturbance and then rounded.

    half : of the thickness, cells ``(n,)``; size : of the disturbance over it; waves : where it
    is thinner (positive) and thicker. What is taken from the one is added to the other.
    """
    where = tuple(cells.T)
    distance, share = liquid.distance[where], np.minimum(size / SLIGHT, 1)

    def shifted(more: float) -> np.ndarray:
        return distance + half * np.clip(size * (waves + more), -SWELLING, AIR)

    level = liquid.level.copy()
    level[where] = (1 - share) * level[where] + share * shifted_to_volume(
        shifted, filled_cells(distance)
    )
    level[where] = rounded(level, where, share)
    # As steep as a distance again, for other thresholds than one half and for the fields'.
    even = LevelSet(level, liquid.velocity, liquid.grid).distance[where]
    level[where] = (1 - share) * level[where] + share * even
    volume = filled_cells(liquid.level[where])
    return shifted_to_volume(lambda more: level[where] + share * more, volume)


def rounded(level: np.ndarray, where: tuple[np.ndarray, ...], share: np.ndarray) -> np.ndarray:
    """Return the level at cells, rounded as surface tension does, by ``share`` ``(n,)`` of it.

    Threshold dynamics: liquid that is blurred and cut off anew moves as its mean curvature tells
    (Merriman, Bence and Osher 1994), here by a value that keeps the volume.
    """
    from scipy.ndimage import gaussian_filter

    box = tuple(slice(max(int(a.min()) - 4, 0), int(a.max()) + 5) for a in where)
    inner = tuple(a - side.start for a, side in zip(where, box, strict=True))
    blurred = gaussian_filter(np.clip(0.5 - level[box], 0, 1), ROUNDING_BLUR)[inner]
    width = np.sqrt(2 * np.pi) * ROUNDING_BLUR  # cells over which a blurred plane's share falls
    moved = (1 - share) * level[where] + share * (0.5 - blurred) * width
    return shifted_to_volume(lambda more: moved + share * more, filled_cells(level[where]))
