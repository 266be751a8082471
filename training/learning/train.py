# SPDX-License-Identifier: GPL-3.0-or-later
"""Train a generator: ours, or the paper's for comparison.

    python -m training train DATA --out RUN --minutes 60
    torchrun --nproc-per-node 2 -m training train DATA --out RUN --minutes 60

A checkpoint is written every few minutes; the same command goes on where a stopped run was.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import torch
from tqdm import tqdm

from liquid_splash_addon.core.generator.loading import load_generator
from liquid_splash_addon.core.generator.precision import DTYPES, fastest_precision
from liquid_splash_addon.core.generator.splash_unet import NetworkConfig

from ..command_line import PROGRESS_BAR, add_options, command_parser, option, read_options
from ..data.batch import Batch
from ..data.items import Item, load_items
from ..data.stream import SampleSpecification, TrainingSamples, stream
from . import parallel
from .learner import Learner
from .monitor import Monitor
from .paper.networks import PaperConfig
from .paper.paper_learner import PaperLearner
from .splash_learner import SplashConfig, SplashLearner


@dataclass(frozen=True)
class TrainConfig:
    """One training run, whichever the model."""

    minutes: float = option(60.0, "wall time of training, measuring not counted")
    steps: int = option(0, "end the run after so many steps instead, if not 0")
    batch: int = option(8, "samples a step, over all processes")
    cells: int = option(64, "side of the boxes; details are learned at twice the resolution")
    crop: int = option(64, "side of the parts on which details are learned, in their cells")
    obstacle: float = option(0.5, "share of samples that are shown their obstacle")
    scenes: int = option(0, "train on so many of the scenes only, if not 0")
    warmup: int = option(100, "steps over which the learning rate rises")
    decay: float = option(0.3, "last share of the run, in which the learning rate falls to 0")
    checkpoint: float = option(4.0, "minutes between checkpoints")
    seed: int = option(0, "of all random choices")


MAY_CHANGE = ("minutes", "steps", "checkpoint")
"""Settings with which a run may go on changed: how long it lasts, how often it is saved."""


class Run:
    """A training run: a learner, what it is to do, and how far it has come."""

    def __init__(self, config: TrainConfig, learner: Learner, out: Path, about: dict[str, Any]):
        self.config, self.learner, self.out, self.about = config, learner, out, about
        self.steps, self.seconds = 0, 0.0

    @property
    def path(self) -> Path:
        """Where the checkpoint lies."""
        return self.out / "checkpoint.pt"

    @property
    def progress(self) -> float:
        """Share of the run done, 0..1."""
        if self.config.steps:
            return min(self.steps / self.config.steps, 1.0)
        return min(self.seconds / (60 * self.config.minutes), 1.0)

    @property
    def rate(self) -> float:
        """Factor on the learning rate: warm-up, constant, then 1 - sqrt decay."""
        late = (self.progress - (1 - self.config.decay)) / max(self.config.decay, 1e-9)
        warm = min((self.steps + 1) / max(self.config.warmup, 1), 1.0)
        return float(warm * (1 - min(max(late, 0.0), 1.0) ** 0.5))

    def save(self) -> None:
        """Write the checkpoint aside, then rename it into place."""
        aside = self.path.with_suffix(".tmp")
        state = {
            **self.about,
            "training": asdict(self.config),
            "learner": self.learner.state(),
            "steps": self.steps,
            "seconds": self.seconds,
        }
        torch.save(state, aside)
        os.replace(aside, self.path)

    def check_settings(self, begun: dict[str, Any]) -> None:
        """Raise ValueError where a run would go on with other settings than it began with."""
        now = asdict(self.config)
        other = [
            f"--{name} {begun[name]}, not {value}"
            for name, value in now.items()
            if name not in MAY_CHANGE and name in begun and begun[name] != value
        ]
        if other:
            raise ValueError(
                f"{self.path} was begun with {', '.join(other)}: choose another --out, or the "
                "settings that it began with"
            )

    def load(self) -> None:
        """Go on from the checkpoint, if there is one.

        Raises ValueError if it is another model's, or was begun with other settings.
        """
        if not self.path.exists():
            return
        state = torch.load(self.path, weights_only=True, map_location="cpu")
        for name, value in self.about.items():
            if state.get(name) != value:
                raise ValueError(
                    f"{self.path} is of another model ({name} {state.get(name)!r}, not "
                    f"{value!r}): choose another --out, or the settings that it began with"
                )
        self.check_settings(state["training"])
        self.learner.restore(state["learner"])
        self.steps, self.seconds = state["steps"], state["seconds"]


def train(
    run: Run,
    items: list[Item],
    validation: list[Item],
    workers: int = 1,
    rank: int = 0,
    world: int = 1,
    reload: Callable[[], list[Item]] | None = None,
) -> None:
    """Train until the run's time is up; rank 0 shows, measures and saves.

    reload : returns the frames that there are by now; asked at every checkpoint.
    """
    config = run.config
    if run.progress >= 1:
        return
    batches = batches_of(run, items, workers, rank, world)
    monitor = Monitor(run.out, validation, run.learner.grids, rank == 0)
    bar = tqdm(total=1.0, initial=run.progress, bar_format=PROGRESS_BAR, disable=rank > 0)
    before = saved = time.monotonic()
    while run.progress < 1:
        batch = next(batches)
        losses = run.learner.step(batch, run.progress, run.rate)
        run.steps += 1
        now = time.monotonic()
        run.seconds = parallel.agree(run.seconds + now - before)
        bar.update(run.progress - bar.n)
        bar.set_postfix_str(
            f"loss {monitor.smooth(losses):.3f}, {config.batch / (now - before):.1f} samples/s, "
            f"step {run.steps}"
        )
        before = now
        if now - saved > 60 * config.checkpoint and rank == 0:
            run.save()
            monitor.look(run.learner, run.steps, run.steps * config.batch, run.seconds)
            if reload and len(found := reload()) > len(items):
                items, batches = found, batches_of(run, found, workers, rank, world)
            before = saved = time.monotonic()  # a look is not training
    bar.close()
    run.learner.finish(batches)
    if rank == 0:
        run.save()
        monitor.look(run.learner, run.steps, run.steps * config.batch, run.seconds)
    parallel.meet()


def batches_of(run: Run, items: list[Item], workers: int, rank: int, world: int) -> Iterator[Batch]:
    """Return the batches that a run has not been trained on yet."""
    config = run.config
    specification = SampleSpecification(config.cells, config.crop, config.obstacle)
    samples = TrainingSamples(items, specification, config.seed)
    seen = run.steps * config.batch
    return stream(samples, config.batch // world, workers, seen, rank, world)


def first_scenes(items: list[Item], count: int) -> list[Item]:
    """Return the frames of the first ``count`` scenes; all if that is 0."""
    scenes = sorted({item.scene for item in items})
    chosen = set(scenes[: count or None])
    return [item for item in items if item.scene in chosen]


def read_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the command line's arguments."""
    parser = command_parser("train", __doc__)
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--out", type=Path, required=True, help="directory of the run")
    parser.add_argument(
        "--model", choices=["ours", "cgan", "unet"], default="ours",
        help="cgan and unet are trained as in the paper: batches of 2, constant rate, whole boxes",
    )  # fmt: skip
    parser.add_argument(
        "--l1-weight", type=float, default=100.0, help="lambda of the paper's losses"
    )
    parser.add_argument("--workers", type=int, default=1, help="processes that prepare samples")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1, help="of this process")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument(
        "--precision", choices=["auto", *DTYPES], default="auto", help="auto: the device's fastest"
    )
    parser.add_argument(
        "--start-from", type=Path, help="weights file to begin with instead of random weights"
    )
    parser.add_argument(
        "--grow", action="store_true", help="also use scenes that appear during the run"
    )
    add_options(parser, TrainConfig)
    add_options(parser, SplashConfig)
    return parser.parse_args(arguments)


def make_run(args: argparse.Namespace) -> Run:
    """Return the run that the arguments describe, where it stopped if it was begun before."""
    config: TrainConfig = read_options(args, TrainConfig)
    name = fastest_precision(args.device) if args.precision == "auto" else args.precision
    if args.model == "ours":
        learner, about = our_learner(args, config, DTYPES[name])
    else:
        config = replace(config, batch=2, crop=0, obstacle=0.0, decay=0.0, warmup=0)
        learner, about = paper_learner(args, config, DTYPES[name])
    args.out.mkdir(parents=True, exist_ok=True)
    run = Run(config, learner, args.out, about)
    run.load()
    return run


def our_learner(
    args: argparse.Namespace, config: TrainConfig, precision: torch.dtype
) -> tuple[Learner, dict[str, Any]]:
    """Return our model, and what checkpoints say of it."""
    options = read_options(args, SplashConfig)
    learner = SplashLearner(
        options, NetworkConfig(), config.cells, args.device, precision, config.seed
    )
    if args.start_from:
        learner.start_from(load_generator(args.start_from, "CPU").network.state_dict())
    return learner, {"kind": "splash"}


def paper_learner(
    args: argparse.Namespace, config: TrainConfig, precision: torch.dtype
) -> tuple[Learner, dict[str, Any]]:
    """Return the paper's model, and what checkpoints say of it."""
    shape = PaperConfig(config.cells, l1_weight=args.l1_weight, adversarial=args.model == "cgan")
    learner = PaperLearner(shape, config.seed, args.device, precision)
    return learner, {"kind": "paper", "config": asdict(shape)}


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    args = read_arguments(arguments)
    torch.set_num_threads(args.threads)
    torch.set_flush_denormal(True)
    rank, world = parallel.start()
    try:
        if args.grow and world > 1:
            raise ValueError(
                "--grow works with one process only: several could see different scenes"
            )

        def reload() -> list[Item]:
            return first_scenes(load_items(args.data, "train"), args.scenes)

        train(
            make_run(args), reload(), load_items(args.data, "validation"), args.workers,
            rank, world, reload if args.grow else None,
        )  # fmt: skip
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    finally:
        parallel.stop()
    return 0
