# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs that make frames, simulated or baked, of several objects one after another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol, TypeVar

from ..scene.objects import Handle
from . import work_queue
from .messages import sentence_for
from .progress import labelled, part_of

if TYPE_CHECKING:
    from ...core.progress import Report


class Ordered(Protocol):
    """Whose frames are to be made."""

    @property
    def item(self) -> Handle:
        """The object."""


class FrameRun(Protocol):
    """A run, with why it ended too early, a sentence for the user."""

    error: str

    @property
    def order(self) -> Ordered:
        """What is to be done."""


Run = TypeVar("Run", bound=FrameRun)


def do_all(do: Callable[[Run, Report], None], runs: Sequence[Run], report: Report) -> None:
    """Do runs one after another. What fails is noted in its run, and the others are done."""
    from ...core.progress import Cancelled

    for number, run in enumerate(runs):
        part = part_of(report, number / len(runs), (number + 1) / len(runs))
        if len(runs) > 1:
            part = labelled(part, run.order.item.name)
        try:
            do(run, part)
        except Cancelled:
            raise
        except Exception as error:
            run.error = sentence_for(error)
            work_queue.print_unexpected(error)
