# SPDX-License-Identifier: GPL-3.0-or-later
"""What is seen of a training run: curves and pictures in TensorBoard, and its accuracy."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL.Image import Image
from torch.utils.tensorboard import SummaryWriter

from ..data.dataset import Item, choose, held_out_sample
from ..data.stream import Lesson, collate
from ..figures.picture import contact_sheet, draw_liquid
from ..measures.metrics import iou
from .learner import Learner
from .losses import Batch

FRAMES = 16
"""Validation frames measured at every look."""

PICTURES = 3
"""Of them, how many are drawn."""

THRESHOLDS = np.linspace(0.1, 0.6, 11)

PIXELS = 256

SMOOTHING = 0.98


class Monitor:
    """Writes into a run's directory: TensorBoard's events, and ``curve.jsonl``, a line a look."""

    def __init__(
        self, out: Path, items: Sequence[Item], grids: tuple[int, ...], active: bool
    ) -> None:
        self.out = out
        self.writer = SummaryWriter(str(out)) if active else None
        self.items = choose(items, FRAMES)
        self.batches: dict[int, list[Batch]] = {cells: [] for cells in grids}
        self.mean: dict[str, float] = {}
        self.count = 0

    def smooth(self, losses: dict[str, float]) -> float:
        """Return the running mean of the loss, and write it down now and then."""
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

        Of the pictures, truths make the first row and answers the second.
        """
        if not self.batches[cells]:
            self.batches[cells] = [held_out_batch(item, cells) for item in self.items]
        scores: list[list[float]] = []
        guesses: list[np.ndarray] = []
        truths: list[np.ndarray] = []
        for batch in self.batches[cells]:
            guess = learner.predict(batch)[0, 0].cpu().numpy()
            truth = batch.distance[0].numpy() < 0
            scores.append([iou(guess > t, truth) for t in THRESHOLDS])
            if len(guesses) < PICTURES:
                guesses.append(guess)
                truths.append(batch.distance[0].numpy())
        means = np.mean(scores, axis=0)
        best = int(means.argmax())
        # Occupancy is no distance; where it is steep, four times it is short of one.
        fields = [*truths, *(np.clip(4 * (THRESHOLDS[best] - g), -1, 1) for g in guesses)]
        pictures = [draw_liquid(f.astype(np.float32), PIXELS, width=1.1 * cells) for f in fields]
        return float(means[best]), float(THRESHOLDS[best]), pictures


def held_out_batch(item: Item, cells: int) -> Batch:
    """Return an unseen frame as a batch of one, without its obstacle."""
    sample, _ = held_out_sample(item, cells)
    return collate([Lesson(sample, None, (0, 0, 0), np.zeros((cells // 2,) * 3, np.float32))])
