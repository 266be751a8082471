# SPDX-License-Identifier: GPL-3.0-or-later
"""Thin liquid that has flown for long is broken up by surface tension.

The slower a splash is drawn, the longer its liquid is in flight, and thin features do not last
(paper, Fig. 7). The simulated liquid that generators learn from shows none of this: its cells are
too coarse for surface tension. Here a sheet parts as real ones do, in two steps: into ligaments
along the flow, and each of these into drops (Villermaux 2007). Both disturbances grow as on a
liquid thread (Rayleigh 1878), first at the free edge ahead and where the flow thins the film.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..compiling import njit
from ..fluid.surface_tension import WATER
from ..grid import LOCAL_SPACING
from ..numeric.box_filter import mean_around
from ..numeric.gradient import unit_gradient
from ..numeric.threads import in_parts
from ..settings import SplashSettings
from ..sketch.strokes import Stroke
from .fields import AIR
from .flight import ages_at, flown
from .level_set import LevelSet
from .streaks import along_flow, noise
from .volume import filled_cells, shifted_to_volume

GROWTH = 0.343
"""Rate at which the fastest disturbance of a thread of radius a grows, times
sqrt(rho a^3 / sigma) (Rayleigh 1878)."""

WAVENUMBER = 1.7
"""Of the streaks, times half the liquid's thickness. A thread's fastest has 0.697, but real
liquid is thinner than cells show: with that, ligaments are so few and thick that what has parted
has less surface than before."""

DISTURBANCE = 0.1
"""Size of the first disturbance over half the liquid's thickness: a splash is no quiet jet."""

SLIGHT, GROWTH_MOST, MOST_EXPONENT = 0.25, 5.0, 12.0
"""Sizes over half the thickness up to which a grown disturbance does not matter, and beyond
which it grows no more: all has parted by then; and the exponent beyond which none is computed."""

SWELLING = 2.0
"""Most by which liquid is thicker where it gathers, over half its thickness: a drop out of a
thread has 1.9 times its radius, one out of a sheet three times."""

BANDS = LOCAL_SPACING * 1.5 ** np.arange(4)
"""Half thicknesses in metres, each with a disturbance of its own; in between they are mixed."""

CALM = 0.7
"""Rate of growth far from the front, where the flow does not thin the film, over the greatest."""

LIGAMENTS, DROPS = 1.8, 5.5
"""Exponents of growth between which ligaments that have formed part into drops: at the second,
what disturbs them along the flow is as large as what parted the sheet across it."""

SPACING = 2.0
"""Cells between places across the flow at which its velocities are compared."""

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
    ages = ages_at(liquid.grid.to_metres(cells + 0.5), points, ages)
    thin = growth(rate, ages, half) > 0
    if not thin.any():
        return liquid
    cells, half, ages = cells[thin], half[thin], ages[thin]
    places, normals = middle(liquid, cells, half)
    waves = disturbance(liquid, places, half, settings.seed, settings.variation)
    haste = CALM + (1 - CALM) * np.maximum(waves.front, thinning(liquid, places, normals, ages))
    exponent = exponents(rate, ages, half) * haste
    size = grown(exponent)
    parting = size > 0
    if not parting.any():
        return liquid
    level = liquid.level.copy()
    beads = np.clip((exponent - LIGAMENTS) / (DROPS - LIGAMENTS), 0, 1) * waves.beads
    height = (size * (waves.streaks + beads))[parting]
    cells, size = cells[parting], size[parting]
    level[tuple(cells.T)] = parted(liquid, cells, half[parting] / liquid.grid.spacing, size, height)
    return replace(liquid, level=level)


def growth(rate: float, ages: np.ndarray | float, half: np.ndarray | float) -> np.ndarray:
    """Return the size of the disturbance over half the thickness, beyond what is SLIGHT.

    rate : GROWTH sqrt(sigma / rho), m^1.5/s; ages : seconds; half : of the thickness, metres.
    """
    return grown(exponents(rate, ages, half))


def exponents(rate: float, ages: np.ndarray | float, half: np.ndarray | float) -> np.ndarray:
    """Return the natural logarithm of how much a disturbance has grown, see :func:`growth`."""
    return np.minimum(rate * np.asarray(ages) / np.asarray(half) ** 1.5, MOST_EXPONENT)


def grown(exponent: np.ndarray) -> np.ndarray:
    """Return the size of a disturbance over half the thickness, beyond what is SLIGHT."""
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


def middle(liquid: LevelSet, cells: np.ndarray, half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where the middle of the liquid is, as seen from ``cells`` ``(n, 3)``, and its normal.

    Places are in cells ``(n, 3)``; half : of the thickness, metres. A disturbance goes through all
    of it.
    """
    inner = np.clip(cells, 1, np.array(liquid.level.shape) - 2)
    depth = half / liquid.grid.spacing + liquid.distance[tuple(cells.T)]
    normals = unit_gradient(liquid.distance, inner)
    return cells + 0.5 - normals * depth[:, None], normals


class Waves(NamedTuple):
    """What disturbs liquid: float32 ``(n,)`` each, see :func:`along_flow`."""

    streaks: np.ndarray
    beads: np.ndarray
    front: np.ndarray


def disturbance(
    liquid: LevelSet, places: np.ndarray, half: np.ndarray, seed: int, variation: float
) -> Waves:
    """Return what disturbs the liquid at ``places`` ``(n, 3)``, cells.

    Its wavelength is that of the fastest growth at each ``half`` thickness ``(n,)``, metres. It
    is the same on grids of any spacing. seed, variation : see :func:`noise`.
    """
    grid, made = liquid.grid, noise(seed, variation)
    # The noise lies in the local box, whatever the cells' number and the part of it shown.
    shift = np.asarray(grid.origin) / grid.spacing
    found = np.zeros((3, len(places)), dtype=np.float32)
    square = np.zeros(len(places), dtype=np.float32)
    steps = np.clip(np.log(half / BANDS[0]) / np.log(BANDS[1] / BANDS[0]), 0, len(BANDS) - 1)
    for number, size in enumerate(BANDS):
        # Mixed halfway between two only: that spares most places one of them.
        share = np.clip(1.5 - 2 * np.abs(steps - number), 0, 1).astype(np.float32)
        met = np.flatnonzero(share)
        if not len(met):
            continue
        parts = along_flow(
            made, places[met], shift, liquid.velocity, liquid.level,
            2 * np.pi / WAVENUMBER * size, grid.spacing,
        )  # fmt: skip
        found[:, met] += share[met] * parts
        square[met] += share[met] ** 2
    found[:2] /= np.sqrt(square)
    return Waves(*found)


def thinning(
    liquid: LevelSet, places: np.ndarray, normals: np.ndarray, ages: np.ndarray
) -> np.ndarray:
    """Return how much the flow has drawn the sheet apart across itself, 0..1, ``(n,)``.

    That is the rate at which it does, times the time of flight: a fan of straight streamlines
    from one point has 1. places : cells ``(n, 3)``; normals : of the sheet, ``(n, 3)``; ages : s.
    """

    def rates(begin: int, end: int) -> np.ndarray:
        at = places[begin:end]
        across = np.cross(normals[begin:end], liquid.flow_at(at))
        across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9)
        apart = liquid.flow_at(at + SPACING * across) - liquid.flow_at(at - SPACING * across)
        return np.asarray((apart * across).sum(axis=1) / (2 * SPACING))

    liquid.flow_at(places[:1])  # what it keeps is made once, not by each thread
    return np.clip(np.concatenate(in_parts(len(places), rates)) * ages, 0.0, 1.0)


def parted(
    liquid: LevelSet, cells: np.ndarray, half: np.ndarray, size: np.ndarray, height: np.ndarray
) -> np.ndarray:
    """Return the level, in cells, at ``cells`` ``(n, 3)``, with the disturbance and then rounded.

    half : of the thickness, cells ``(n,)``; size : of the disturbance over it; height : what it
    takes away (positive) and adds, over it. What is taken from the one is added to the other.
    """
    where = tuple(cells.T)
    distance, share = liquid.distance[where], np.minimum(size / SLIGHT, 1)

    def shifted(more: float) -> np.ndarray:
        return distance + half * np.clip(height + size * more, -SWELLING, AIR)

    level = liquid.level.copy()
    level[where] = (1 - share) * level[where] + share * shifted_to_volume(
        shifted, filled_cells(distance)
    )
    volume = filled_cells(liquid.level[where])
    level[where] = rounded(level, where, share)
    # As steep as a distance again, for other thresholds than one half and for the fields'.
    even = LevelSet(level, liquid.velocity, liquid.grid).distance[where]
    level[where] = (1 - share) * level[where] + share * even
    return shifted_to_volume(lambda more: level[where] + share * more, volume)


def rounded(level: np.ndarray, where: tuple[np.ndarray, ...], share: np.ndarray) -> np.ndarray:
    """Return the level at cells, rounded as surface tension does, by ``share`` ``(n,)`` of it.

    Threshold dynamics: liquid that is blurred and cut off anew moves as its mean curvature tells
    (Merriman, Bence and Osher 1994). The volume is for the caller to keep.
    """
    from scipy.ndimage import gaussian_filter

    box = tuple(slice(max(int(a.min()) - 4, 0), int(a.max()) + 5) for a in where)
    inner = tuple(a - side.start for a, side in zip(where, box, strict=True))
    blurred = gaussian_filter(np.clip(0.5 - level[box], 0, 1), ROUNDING_BLUR)[inner]
    width = np.sqrt(2 * np.pi) * ROUNDING_BLUR  # cells over which a blurred plane's share falls
    return np.asarray((1 - share) * level[where] + share * (0.5 - blurred) * width)
