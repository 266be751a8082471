# SPDX-License-Identifier: GPL-3.0-or-later
"""What is seen of a training run: curves and pictures in TensorBoard, and its accuracy."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from torch.utils.tensorboard import SummaryWriter

from .dataset import Item, choose, held_out_sample
from .learning import Learner
from .losses import Batch
from .metrics import iou
from .picture import contact_sheet, draw_liquid
from .stream import Lesson, collate

FRAMES = 16
"""Validation frames measured at every look."""

PICTURES = 3
"""Of them, how many are drawn."""

THRESHOLDS = np.linspace(0.2, 0.6, 9)

SMOOTHING = 0.98


class Monitor:
    """Writes into a run's directory: TensorBoard's events, and ``curve.jsonl``, a line a look."""

    def __init__(self, out: Path, items: Sequence[Item], cells: int, active: bool) -> None:
        self.out, self.cells = out, cells
        self.writer = SummaryWriter(str(out)) if active else None
        self.items = choose(items, FRAMES)
        self.batches: list[Batch] = []
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
        self.batches = self.batches or [held_out_batch(item, self.cells) for item in self.items]
        guesses = [learner.predict(batch)[0, 0].cpu().numpy() for batch in self.batches]
        truths = [batch.distance[0].numpy() < 0 for batch in self.batches]
        scores = np.array(
            [
                [iou(g > t, truth) for t in THRESHOLDS]
                for g, truth in zip(guesses, truths, strict=True)
            ]
        ).mean(axis=0)
        best = int(scores.argmax())
        line = {
            "minutes": round(seconds / 60, 2),
            "steps": steps,
            "samples": samples,
            "loss": round(self.mean["loss"], 4),
            "iou": round(float(scores[best]), 4),
            "threshold": float(THRESHOLDS[best]),
        }
        with open(self.out / "curve.jsonl", "a") as file:
            file.write(json.dumps(line) + "\n")
        self.writer.add_scalar("validation IoU", scores[best], steps)
        self.draw(guesses, truths, float(THRESHOLDS[best]), steps)

    def draw(
        self, guesses: list[np.ndarray], truths: list[np.ndarray], threshold: float, steps: int
    ) -> None:
        """Write a picture: truths in the first row, answers in the second."""
        assert self.writer is not None
        fields = [np.clip(2 * (0.5 - t.astype(np.float32)), -1, 1) for t in truths[:PICTURES]]
        fields += [np.clip(4 * (threshold - g), -1, 1) for g in guesses[:PICTURES]]
        sheet = contact_sheet(
            [draw_liquid(f, 256, width=1.1 * self.cells) for f in fields], PICTURES
        )
        self.writer.add_image("truth and answer", np.asarray(sheet), steps, dataformats="HWC")
        self.writer.flush()


def held_out_batch(item: Item, cells: int) -> Batch:
    """Return an unseen frame as a batch of one, without its obstacle."""
    sample, _ = held_out_sample(item, cells)
    return collate([Lesson(sample, None, (0, 0, 0), np.zeros((cells // 2,) * 3, np.float32))])
