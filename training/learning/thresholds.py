# SPDX-License-Identifier: GPL-3.0-or-later
"""From which occupancy on a model's cells are liquid."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

import numpy as np
from tqdm import tqdm

from liquid_splash_addon.core.condition.voxelize import Condition
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import Fields

from ..data.items import Item
from ..data.samples import held_out_sample
from ..measures.metrics import threshold_ious


class Answer(Protocol):
    """What a model must be able to do to be measured."""

    def generate(
        self, condition: Condition, grid: Grid, latent: np.ndarray | None = None
    ) -> Fields:
        """Return the splash, see ``Generator.generate``; ValueError if it cannot on this grid."""


def best_threshold(
    answer: Answer, items: Sequence[Item], cells: int, tried: Iterable[float]
) -> float:
    """Return the one of ``tried`` with the best mean IoU on ``items`` at ``cells``^3.

    answer : one whose own threshold is 0.5 so far
    """
    tried, scores = list(tried), []
    for item in tqdm(items, desc=f"threshold {cells}^3", leave=False):
        sample, _ = held_out_sample(item, cells)
        occupancy = answer.generate(sample.condition, sample.grid).occupancy
        scores.append(threshold_ious(occupancy, sample.distance < 0, tried))
    return tried[int(np.mean(scores, axis=0).argmax())]
