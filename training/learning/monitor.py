# SPDX-License-Identifier: GPL-3.0-or-later
"""What a training run shows of itself: curves and pictures in TensorBoard, and its accuracy."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL.Image import Image
from torch.utils.tensorboard import SummaryWriter

from ..data.batch import Batch
from ..data.items import Item, choose
from ..data.samples import held_out_sample
from ..data.stream import TrainingSample, collate
from ..figures.picture import contact_sheet, draw_liquid
from ..measures.metrics import threshold_ious
from .learner import Learner

VALIDATION_FRAMES = 16
"""Frames that are measured at every look."""

PICTURES = 3
"""How many of them are drawn."""

MONITOR_THRESHOLDS = np.linspace(0.1, 0.6, 11)
"""Occupancies tried as the one from which on cells are liquid."""

PICTURE_PIXELS = 256
"""Side of a picture."""

SMOOTHING = 0.98
"""Share of a loss's running mean that is kept at each step."""


class Monitor:
    """Writes into a run's directory: TensorBoard's events, and ``curve.jsonl``, a line a look."""

    def __init__(
        self, out: Path, items: Sequence[Item], grids: tuple[int, ...], active: bool
    ) -> None:
        self.out = out
        self.writer = SummaryWriter(str(out)) if active else None
        self.items = choose(items, VALIDATION_FRAMES)
        self.batches: dict[int, list[Batch]] = {cells: [] for cells in grids}
        self.mean: dict[str, float] = {}
        self.count = 0

    def smooth(self, losses: dict[str, float]) -> float:
        """Return the running mean of the loss; every 20 steps all losses go to TensorBoard."""
        self.count += 1
        for name, value in losses.items():
            self.mean[name] = SMOOTHING * self.mean.get(name, value) + (1 - SMOOTHING) * value
        if self.writer and self.count % 20 == 0:
            for name, value in self.mean.items():
                self.writer.add_scalar(name, value, self.count)
        return self.mean["loss"]

    def look(self, learner: Learner, steps: int, samples: int, seconds: float) -> None:
        """Measure the learner on the validation frames and draw some of its answers."""
        if self.writer is None:
            return
        line: dict[str, object] = {
            "minutes": round(seconds / 60, 2),
            "steps": steps,
            "samples": samples,
            "loss": round(self.mean["loss"], 4),
        }
        for cells in self.batches:
            score, threshold, pictures = self.measure(learner, cells)
            line[f"iou_{cells}"] = round(score, 4)
            line[f"threshold_{cells}"] = round(threshold, 3)
            self.writer.add_scalar(f"validation IoU {cells}", score, steps)
            sheet = np.asarray(contact_sheet(pictures, PICTURES))
            self.writer.add_image(f"truth and answer {cells}", sheet, steps, dataformats="HWC")
        with open(self.out / "curve.jsonl", "a") as file:
            file.write(json.dumps(line) + "\n")
        self.writer.flush()

    def measure(self, learner: Learner, cells: int) -> tuple[float, float, list[Image]]:
        """Return the IoU at the best threshold, that threshold, and pictures.

        The pictures are truths, for a first row, then answers, for a second.
        """
        if not self.batches[cells]:
            self.batches[cells] = [held_out_batch(item, cells) for item in self.items]
        scores: list[list[float]] = []
        guesses: list[np.ndarray] = []
        truths: list[np.ndarray] = []
        for batch in self.batches[cells]:
            guess = learner.predict(batch)[0, 0].cpu().numpy()
            truth = batch.box.distance[0].numpy() < 0
            scores.append(threshold_ious(guess, truth, MONITOR_THRESHOLDS))
            if len(guesses) < PICTURES:
                guesses.append(guess)
                truths.append(batch.box.distance[0].numpy())
        means = np.mean(scores, axis=0)
        best = int(means.argmax())
        # Occupancy is not a distance; where it is steep, four times it is less than one.
        fields = [*truths, *(np.clip(4 * (MONITOR_THRESHOLDS[best] - g), -1, 1) for g in guesses)]
        pictures = [
            draw_liquid(f.astype(np.float32), PICTURE_PIXELS, width=1.1 * cells) for f in fields
        ]
        return float(means[best]), float(MONITOR_THRESHOLDS[best]), pictures


def held_out_batch(item: Item, cells: int) -> Batch:
    """Return an unseen frame as a batch of one, without its obstacle."""
    sample, _ = held_out_sample(item, cells)
    return collate(
        [TrainingSample(sample, None, (0, 0, 0), np.zeros((cells // 2,) * 3, np.float32))]
    )
