# SPDX-License-Identifier: GPL-3.0-or-later
"""What the patch classifier is trained on: patches of sketches, and which of them lie in liquid."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates
from tqdm import tqdm

from liquid_splash_addon.core.condition.patches.features import PatchGraph, patch_graph
from liquid_splash_addon.core.condition.patches.gabriel import find_patches, sample_points_of
from liquid_splash_addon.core.condition.patches.sampling import sample_patches
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.sketch.local_frame import fit_frame
from liquid_splash_addon.core.sketch.strokes import Stroke

from ..data.items import Item
from ..data.samples import held_out_strokes, resample
from ..data.stream import draw_sketch
from ..simulation.scheduling import end_with_parent


class LabelledPatches(NamedTuple):
    """The ``m`` patches of one sketch, each a triangle, and how much of each lies in liquid.

    Attributes
    ----------
    graph : their features
    inside, near : float32 ``(m,)``, the share of each one's samples that lies in liquid, and
        within a cell of it (at 128^3)
    samples : float32 ``(m,)``, how many samples each has
    """

    graph: PatchGraph
    inside: np.ndarray
    near: np.ndarray
    samples: np.ndarray


def label_patches(item: Item, sketch: int | None) -> LabelledPatches | None:
    """Return the patches of a random training sketch of a frame; None where it has none.

    sketch : its number; None is the sketch that models are measured on.
    """
    stored = item.load()
    if sketch is None:
        strokes: Sequence[Stroke] = held_out_strokes(item, stored)
    else:
        rng = np.random.default_rng([item.seed, item.number, sketch])
        strokes = draw_sketch(item, stored, rng)
    frame, grid = fit_frame(strokes), Grid.local()
    points = sample_points_of(frame.strokes_to_local(strokes))
    patches = find_patches(points)
    count = len(patches.triangles)
    if not count:
        return None
    distance, _ = resample(stored, item.spacing, frame, grid)
    numbers = np.arange(count, dtype=np.float64)[:, None]
    where, values = sample_patches(points, patches, numbers)
    depth = map_coordinates(distance, grid.to_cells(where).T - 0.5, order=1, mode="nearest")
    which = values[:, 0].astype(int)
    samples = np.bincount(which, minlength=count)
    shares = [np.bincount(which, depth < most, count) / samples for most in (0.0, 1.0)]
    return LabelledPatches(
        patch_graph(points, patches),
        *(part.astype(np.float32) for part in (*shares, samples)),
    )


def label_all(
    items: Sequence[Item], sketches: Sequence[int | None], workers: int
) -> list[LabelledPatches]:
    """Return the patches of each of ``sketches`` of each item, as far as they have any.

    workers : processes that share the work
    """
    labelled: list[LabelledPatches] = []
    with ProcessPoolExecutor(workers, get_context("spawn"), initializer=end_with_parent) as pool:
        for sketch in sketches:
            found = pool.map(partial(label_patches, sketch=sketch), items, chunksize=8)
            bar = tqdm(found, total=len(items), desc="sketches", unit="frame", leave=False)
            labelled += [patches for patches in bar if patches is not None]
    return labelled
