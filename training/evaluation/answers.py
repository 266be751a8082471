# SPDX-License-Identifier: GPL-3.0-or-later
"""Whatever answers a sketch with a splash: our weights, or a training run of the paper's model."""

from __future__ import annotations

import argparse
import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
import torch

from liquid_splash_addon.core.condition.voxelize import Condition
from liquid_splash_addon.core.generator.generator import Generator
from liquid_splash_addon.core.generator.latent import draw_latent
from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.generator.precision import PRECISIONS
from liquid_splash_addon.core.generator.weights_file import default_weights_path
from liquid_splash_addon.core.grid import LOCAL_CELLS, Grid
from liquid_splash_addon.core.liquid.fields import Fields

from ..data.items import SPLITS, Item, choose, load_items
from ..data.sketching import STROKES_IN_TESTS
from ..learning.paper.networks import load_paper
from ..learning.thresholds import Answer, best_threshold

CHECKPOINT = "checkpoint.pt"

BASELINES = ("dilated_strokes", "dilated_spans", "nearest")
"""Names that no model may have."""

PAPER_THRESHOLDS = np.linspace(0.05, 0.95, 19)
"""Tried for the paper's networks. A plain L1 makes them certain: their best may lie anywhere."""


class OneGridAnswer(Answer, Protocol):
    """A model for one grid only, with the output from which on a cell of it is liquid."""

    threshold: float

    @property
    def cells(self) -> int:
        """Side of the grid."""


class ByGrid:
    """One model that was trained separately for each grid."""

    def __init__(self, answers: Sequence[OneGridAnswer]) -> None:
        self.answers = {answer.cells: answer for answer in answers}

    def generate(
        self, condition: Condition, grid: Grid, latent: np.ndarray | None = None
    ) -> Fields:
        """Return the splash of the run for this grid; see :class:`Answer`."""
        cells = grid.shape[0]
        if cells not in self.answers:
            raise ValueError(f"there is no run of it for {cells}^3 cells")
        return self.answers[cells].generate(condition, grid, latent)


def load_answer(path: Path, precision: str = "float32") -> Answer:
    """Return the model at ``path``: a weights file, or the directory of a training run.

    Raises ValueError for what is neither, and for runs of our own model: weights alone have the
    calibrated threshold.
    """
    if not path.is_dir():
        return load_generator(
            path, "CPU" if PRECISIONS[precision].eight_bits else "AUTO", precision
        )
    try:
        state = torch.load(path / CHECKPOINT, map_location="cpu", weights_only=True, mmap=True)
    except OSError as error:
        raise ValueError(f"{path} holds no training run ({error.strerror})") from error
    if state.get("kind") != "paper":
        raise ValueError(
            f"{path} is no run of the paper's model: give the weights that "
            "`python -m training export` makes of it"
        )
    return ByGrid([load_paper(path)])


def load_answers(
    requests: Iterable[str], precision: str = "float32"
) -> tuple[dict[str, Answer], dict[str, str]]:
    """Return the models that are asked for, and the hashes of their files, both by name.

    requests : ``name=PATH`` each; a name may have several runs of the paper's model, one for each
    grid. precision : that our weights run in, a key of ``core.generator.precision.PRECISIONS``.

    Raises ValueError for a request that is none, or whose name or grid is taken.
    """
    answers: dict[str, Answer] = {}
    hashes: dict[str, str] = {}
    for request in requests:
        name, _, place = request.partition("=")
        if not name or not place or name in BASELINES:
            raise ValueError(f"'{request}' is not NAME=PATH with a name of its own")
        answer, before = load_answer(Path(place), precision), answers.get(name)
        if isinstance(answer, ByGrid) and isinstance(before, ByGrid):
            if answer.answers.keys() & before.answers.keys():
                raise ValueError(f"{name} has two runs for the same grid")
            before.answers |= answer.answers
        elif before is not None:
            raise ValueError(f"'{request}' is not NAME=PATH with a name of its own")
        else:
            answers[name] = answer
        file = Path(place) / CHECKPOINT if Path(place).is_dir() else Path(place)
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        hashes[name] = f"{hashes[name]} {digest}" if name in hashes else digest
    return answers, hashes


def calibrate(answer: Answer, items: Sequence[Item], grids: Iterable[int]) -> None:
    """Set the thresholds of the paper's model to those with the best IoU; ours has its own."""
    if isinstance(answer, ByGrid):
        for cells in answer.answers.keys() & set(grids):
            run = answer.answers[cells]
            run.threshold = best_threshold(run, items, cells, PAPER_THRESHOLDS)


def latents_for(answer: Answer, count: int) -> list[np.ndarray]:
    """Return the latents of seeds 0 to ``count`` - 1 at full variation.

    A model that is not ours takes any array as the seed of its random draws (dropout).
    """
    if isinstance(answer, Generator):
        drawn = [draw_latent(answer.config, seed, 1.0) for seed in range(count)]
        return [latent for latent in drawn if latent is not None]
    return [np.random.default_rng(seed).standard_normal(8) for seed in range(count)]


def read_arguments(
    parser: argparse.ArgumentParser, arguments: Sequence[str], most: int
) -> argparse.Namespace:
    """Return the options of a command that measures a model on frames, ``most`` by default."""
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--model", type=Path, default=default_weights_path(), help="weights or run")
    parser.add_argument("--split", default="test", choices=SPLITS)
    parser.add_argument("--most", type=int, default=most, help="frames at the most")
    parser.add_argument("--cells", type=int, default=LOCAL_CELLS, help="side of the box")
    parser.add_argument(
        "--strokes",
        type=int,
        help=f"in each sketch; by default {STROKES_IN_TESTS[0]} to {STROKES_IN_TESTS[1]}",
    )
    args = parser.parse_args(arguments)
    if args.strokes is not None and args.strokes < 1:
        parser.error("--strokes must be 1 or more")
    return args


def stroke_counts(args: argparse.Namespace) -> tuple[int, int]:
    """Least and greatest number of strokes in a sketch that the options ask for."""
    return (args.strokes, args.strokes) if args.strokes is not None else STROKES_IN_TESTS


def chosen(args: argparse.Namespace) -> tuple[list[Item], Answer]:
    """Return the frames and the model that the options name; ValueError where there are none."""
    return choose(load_items(args.data, args.split), args.most), load_answer(args.model)
