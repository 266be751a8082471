# SPDX-License-Identifier: GPL-3.0-or-later
"""What the training loop asks of a model, whichever it is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any

from torch import Tensor

from ..data.batch import Batch


class Learner(ABC):
    """A model with its losses and optimisers. The loop around it keeps time and checkpoints.

    Attributes
    ----------
    grids : sides of the boxes, in cells, for which it answers
    """

    grids: tuple[int, ...]

    @abstractmethod
    def step(self, batch: Batch, progress: float, rate: float) -> dict[str, float]:
        """Train on one batch and return its losses by name, 'loss' among them.

        progress : share of the run done, 0..1; rate : factor on the learning rate (warm-up and
        decay), 0..1.
        """

    @abstractmethod
    def finish(self, batches: Iterator[Batch]) -> None:
        """Make the model ready for use at the end of a run (statistics of norms)."""

    @abstractmethod
    def predict(self, batch: Batch) -> Tensor:
        """Return ``(B, 4, X, Y, Z)``: occupancy 0..1 and velocity over the velocity scale.

        batch : whole boxes of one of ``grids``.
        """

    @abstractmethod
    def state(self) -> dict[str, Any]:
        """Return all that a run needs to go on exactly where it was: tensors and plain values."""

    @abstractmethod
    def restore(self, state: dict[str, Any]) -> None:
        """Go on from what :meth:`state` returned."""
