# SPDX-License-Identifier: GPL-3.0-or-later
"""What a generator must beat: dilated strokes and patches, and the most similar example."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
from numba import njit
from scipy.ndimage import distance_transform_edt
from tqdm import tqdm

from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.sketch.local_frame import fit_frame
from liquid_splash_addon.core.sketch.strokes import Stroke, resampled_points

from ..data.items import Item
from ..data.samples import held_out_strokes, resample
from ..measures.metrics import iou
from ..simulation.scheduling import end_with_parent

CLOUD_POINTS = 256
"""Points that represent a sketch in the search for the nearest one."""

SKETCHES_A_PROCESS = 32
"""Sketches that are traced in the time that a process takes to start."""


def distance_to(cells: np.ndarray) -> np.ndarray:
    """Return each cell's distance to the nearest of ``cells``, float32, in cells."""
    return np.asarray(distance_transform_edt(~cells), dtype=np.float32)


def best_radius(distances: Iterable[np.ndarray], truths: Iterable[np.ndarray]) -> float:
    """Return the radius (cells) whose dilated strokes have the best mean IoU with the truth."""
    radii = np.arange(0.5, 16, 0.5)
    scores = [
        [iou(distance <= radius, truth) for radius in radii]
        for distance, truth in zip(distances, truths, strict=True)
    ]
    return float(radii[int(np.mean(scores, axis=0).argmax())])


def sketch_points(strokes: Sequence[Stroke], rng: np.random.Generator) -> np.ndarray:
    """Random points of the sketch in its own local frame, float32 ``(CLOUD_POINTS, 3)``."""
    local = fit_frame(strokes).strokes_to_local(strokes)
    points, _ = resampled_points(local, 0.002)
    return points[rng.integers(0, len(points), CLOUD_POINTS)]


def sketch_of(item: Item) -> list[Stroke]:
    """Return the strokes of a frame, see ``held_out_strokes``."""
    return held_out_strokes(item, item.load())


def trace_sketches(items: Sequence[Item], workers: int) -> list[list[Stroke]]:
    """Return the strokes of each frame; ``workers`` processes trace them."""
    bar = partial(tqdm, total=len(items), desc="training sketches", leave=False)
    if workers < 2:
        return list(bar(map(sketch_of, items)))
    with ProcessPoolExecutor(workers, get_context("spawn"), initializer=end_with_parent) as pool:
        return list(bar(pool.map(sketch_of, items, chunksize=8)))


class NearestExample:
    """Answers with the training frame whose sketch is nearest (symmetric Chamfer distance)."""

    def __init__(self, items: Sequence[Item], seed: int = 0, workers: int = 1) -> None:
        rng = np.random.default_rng(seed)
        self.items = items
        self.strokes = trace_sketches(items, min(workers, len(items) // SKETCHES_A_PROCESS))
        self.clouds = np.stack([sketch_points(s, rng) for s in self.strokes])

    def answer(self, strokes: Sequence[Stroke], grid: Grid) -> tuple[np.ndarray, np.ndarray]:
        """Return distance ``(X, Y, Z)`` and velocity ``(3, X, Y, Z)`` of the nearest example."""
        cloud = sketch_points(strokes, np.random.default_rng(0))
        best = int(np.argmin(_chamfer(self.clouds, cloud)))
        item = self.items[best]
        return resample(item.load(), item.spacing, fit_frame(self.strokes[best]), grid)


@njit(cache=True, fastmath=True)
def _chamfer(clouds, cloud):
    out = np.empty(len(clouds))
    nearest = np.empty(cloud.shape[0], dtype=np.float32)
    for n in range(len(clouds)):
        total = 0.0
        nearest[:] = 1e30
        for i in range(clouds.shape[1]):
            best = np.float32(1e30)
            for j in range(cloud.shape[0]):
                x = clouds[n, i, 0] - cloud[j, 0]
                y = clouds[n, i, 1] - cloud[j, 1]
                z = clouds[n, i, 2] - cloud[j, 2]
                d = x * x + y * y + z * z
                best = min(best, d)
                nearest[j] = min(nearest[j], d)
            total += np.sqrt(best)
        out[n] = total / clouds.shape[1] + np.sqrt(nearest).mean()
    return out
