# SPDX-License-Identifier: GPL-3.0-or-later
"""Training samples without end: strokes, frame and crop drawn anew for every use of a frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
from torch.nn import functional as F
from torch.utils.data import DataLoader, Dataset, Sampler

from liquid_splash_addon.core.generator.sparse import closeness
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.sketch.local_frame import Frame, fit_frame
from liquid_splash_addon.core.sketch.strokes import Stroke

from ..scenes.bodies import Body
from .batch import Batch, Cells
from .frames import StoredFrame
from .items import Item
from .samples import Sample, augmented_frame, samples_on
from .sketching import PARTLY, STROKES_IN_TRAINING, draw_strokes, trace_frame

TRACED_IN_TRAINING = 64
"""Streamlines traced for one use of a frame: enough to draw 20 strokes from, and quick."""

DENSE, DENSE_SHARE = (21, 64), 0.1
"""Numbers of strokes of a tenth of the samples: people paint densely too, and a network that
never saw that answers with less liquid the more strokes there are."""

ALIGNED = 4
"""Crops begin at multiples of so many fine cells: whole cells of the draft's features."""


@dataclass(frozen=True)
class SampleSpecification:
    """What samples are to hold.

    Attributes
    ----------
    cells : side of the draft's box
    crop : side of the part at twice that resolution; 0 for none
    obstacle : share of the samples that are shown their obstacle
    """

    cells: int = 64
    crop: int = 64
    obstacle: float = 0.5


class TrainingSample(NamedTuple):
    """The whole box of one sketch, a part of it at twice the resolution, and the obstacle.

    start : the part's first cell in the fine grid; obstacle : ``(cells / 2,) * 3`` closeness.
    """

    box: Sample
    part: Sample | None
    start: tuple[int, int, int]
    obstacle: np.ndarray


def obstacle_closeness(body: Body, frame: Frame, cells: int) -> np.ndarray:
    """Return ``core.generator.sparse.closeness`` of a body on ``cells``^3 of the local box.

    body : in metres; the result is float32 ``(cells, cells, cells)``
    """
    grid = Grid.local(cells)
    points = frame.points_to_drawing(grid.centres().reshape(-1, 3).astype(np.float64))
    distance = torch.from_numpy(body.distance(points) / grid.spacing)
    return closeness(distance, grid.spacing).float().reshape(grid.shape).numpy()


def random_part(
    strokes: Sequence[Stroke],
    frame: Frame,
    specification: SampleSpecification,
    rng: np.random.Generator,
) -> tuple[Grid, tuple[int, int, int]]:
    """Return a part of the fine grid around a random point of a stroke, and its first cell."""
    full, crop = Grid.local(2 * specification.cells), specification.crop
    stroke = strokes[rng.integers(len(strokes))]
    point = frame.points_to_local(stroke.points[rng.integers(len(stroke.points))][None])
    reach = crop // 3
    corner = full.cell_of(point)[0] - crop // 2 + rng.integers(-reach, reach + 1, 3)
    most = 2 * specification.cells - crop
    x, y, z = (int(np.clip(c // ALIGNED * ALIGNED, 0, most)) for c in corner)
    return full.crop((x, y, z), (crop,) * 3), (x, y, z)


def draw_sketch(item: Item, stored: StoredFrame, rng: np.random.Generator) -> list[Stroke]:
    """Return the strokes of a random sketch of a frame."""
    parts = rng.random() < PARTLY
    lines = trace_frame(stored, item.spacing, rng, TRACED_IN_TRAINING, parts)
    counts = DENSE if rng.random() < DENSE_SHARE else STROKES_IN_TRAINING
    return draw_strokes(lines, rng, counts, jitter=True)


def draw_sample(
    item: Item,
    stored: StoredFrame,
    specification: SampleSpecification,
    rng: np.random.Generator,
) -> TrainingSample:
    """Return a random sample of a frame."""
    strokes = draw_sketch(item, stored, rng)
    frame = augmented_frame(fit_frame(strokes), strokes, rng)
    grids, start = [Grid.local(specification.cells)], (0, 0, 0)
    if specification.crop:
        grid, start = random_part(strokes, frame, specification, rng)
        grids.append(grid)
    box, *parts = samples_on(stored, item.spacing, strokes, frame, grids)
    half = specification.cells // 2
    if rng.random() < specification.obstacle:
        near = obstacle_closeness(item.obstacle, frame, half)
    else:
        near = np.zeros((half,) * 3, dtype=np.float32)
    return TrainingSample(box, parts[0] if parts else None, start, near)


class TrainingSamples(Dataset[TrainingSample]):
    """Sample number n is always the same one, however many workers or processes there are.

    Frames stay decoded in memory once they were read: about a megabyte each.
    """

    def __init__(
        self, items: Sequence[Item], specification: SampleSpecification, seed: int
    ) -> None:
        self.items, self.specification, self.seed = list(items), specification, seed
        self.read: dict[int, StoredFrame] = {}
        self.order: tuple[int, np.ndarray] = (-1, np.zeros(0, dtype=int))

    def __getitem__(self, number: int) -> TrainingSample:
        epoch, place = divmod(number, len(self.items))
        if self.order[0] != epoch:
            rng = np.random.default_rng([self.seed, epoch])
            self.order = epoch, rng.permutation(len(self.items))
        index = int(self.order[1][place])
        if index not in self.read:
            self.read[index] = self.items[index].load()
        # A copy: the distance and velocity that it computes on demand are not kept.
        stored = replace(self.read[index])
        rng = np.random.default_rng([self.seed, 1, number])
        return draw_sample(self.items[index], stored, self.specification, rng)


class SampleNumbers(Sampler[int]):
    """The numbers of the samples that one process of several takes, without end."""

    def __init__(self, first: int, rank: int, world: int) -> None:
        self.first, self.rank, self.world = first, rank, world

    def __iter__(self) -> Iterator[int]:
        number = self.first + self.rank
        while True:
            yield number
            number += self.world


def one_thread(_: int) -> None:
    """Keep a worker to one thread: there is one for each core already."""
    torch.set_num_threads(1)


def stream(
    samples: TrainingSamples,
    batch: int,
    workers: int,
    first: int = 0,
    rank: int = 0,
    world: int = 1,
) -> Iterator[Batch]:
    """Return batches without end, from sample ``first`` on; ``batch`` samples for each process.

    workers : processes that draw the samples, 0 to draw them in this one; rank, world : of this
    process among those that train.
    """
    loader = DataLoader(
        samples,
        batch,
        sampler=SampleNumbers(first, rank, world),
        num_workers=workers,
        collate_fn=collate,
        worker_init_fn=one_thread,
        prefetch_factor=4 if workers else None,
        pin_memory=torch.cuda.is_available(),
    )
    return iter(loader)


def collate(samples: Sequence[TrainingSample]) -> Batch:
    """Return samples of one shape as a batch."""
    box = Cells.of([sample.box for sample in samples])
    obstacle = torch.from_numpy(np.stack([sample.obstacle for sample in samples]))[:, None]
    obstacle = F.interpolate(obstacle, scale_factor=2, mode="trilinear")
    parts = [sample.part for sample in samples if sample.part is not None]
    if not parts:
        return Batch(box, obstacle)
    start = torch.tensor([sample.start for sample in samples])
    return Batch(box, obstacle, Cells.of(parts), start)
