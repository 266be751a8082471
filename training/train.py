# SPDX-License-Identifier: GPL-3.0-or-later
"""Train the generator.

    python -m training.train DATA --out RUN --minutes 60

Checkpoints are written every few minutes; the same command goes on where a stopped run was.
"""

from __future__ import annotations

import argparse
import copy
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F
from torch.utils.data import DataLoader, IterableDataset
from tqdm import tqdm

from liquid_splash_addon.core.grid import LOCAL_CELLS, LOCAL_SPACING
from liquid_splash_addon.core.network import Encoding, NetworkConfig, SplashNetwork

from .dataset import Item, Sample, load_items, training_samples
from .losses import VELOCITY_SCALE, Batch, sample_losses

SETTLING = 32
"""Batches from which the statistics of the averaged weights are taken at the end."""


@dataclass(frozen=True)
class TrainConfig:
    """One training run."""

    minutes: float = 60.0  # wall time, all in
    batch: int = 4
    cells: int = 64  # side of the cubes trained on: whole boxes as drafts, crops at full resolution
    rate: float = 2e-3  # AdamW's learning rate
    warmup: int = 100  # steps
    decay: float = 0.3  # last share of the run, in which the rate falls to zero
    weight_decay: float = 1e-2
    average: float = 0.995  # of the weights (EMA), per step
    imle_from: float = 0.5  # share of the run after which latents are trained
    candidates: int = 3  # latents tried for each sample; the best is trained (conditional IMLE)
    deterministic: float = 0.33  # share of batches with latent zero, then
    checkpoint: float = 3.0  # minutes between checkpoints
    freeze_from: float = 0.8  # share of the run after which batch norm's statistics stand still
    seed: int = 0


class Stream(IterableDataset[Sample]):
    """Endless training samples; a fresh seed for every worker and every start."""

    def __init__(self, items: list[Item], seed: int, cells: int) -> None:
        self.items, self.seed, self.cells = items, seed, cells

    def __iter__(self) -> Iterator[Sample]:
        info = torch.utils.data.get_worker_info()
        if info:
            torch.set_num_threads(1)
        return training_samples(self.items, self.seed * 1000 + (info.id if info else 0), self.cells)


def collate(samples: list[Sample]) -> Batch:
    """Return samples of one shape as a batch."""
    condition = torch.from_numpy(np.stack([s.condition for s in samples]))
    condition[:, 1:] /= VELOCITY_SCALE
    scale = torch.tensor([np.log2(s.grid.spacing / LOCAL_SPACING) for s in samples])
    return Batch(
        condition.to(memory_format=torch.channels_last_3d),
        scale.float(),
        torch.from_numpy(np.stack([s.distance for s in samples])),
        torch.from_numpy(np.stack([s.velocity for s in samples]) / np.float32(VELOCITY_SCALE)),
    )


def random_latents(config: NetworkConfig, batch: Batch, generator: torch.Generator) -> Tensor:
    """Return latents on the decoder's coarsest level, ``(B, L, x, y, z)``.

    A crop at full resolution sees as much of the lattice as it covers of the box, so all
    samples see lattice cells of one size in metres.
    """
    cells = batch.condition.shape[-1]
    coarsest = cells >> (len(config.widths) - 1)
    latents = []
    for scale in batch.scale:
        seen = max(round(cells * 2 ** float(scale) * config.latent_cells / LOCAL_CELLS), 1)
        lattice = torch.randn((1, config.latent_channels, seen, seen, seen), generator=generator)
        latents.append(F.interpolate(lattice, size=(coarsest,) * 3, mode="trilinear"))
    return torch.cat(latents)


def best_latents(
    network: SplashNetwork, encoding: Encoding, batch: Batch, tries: list[Tensor]
) -> Tensor:
    """Return for each sample the latent in ``tries`` whose splash is nearest the truth (IMLE)."""
    with torch.no_grad():
        losses = torch.stack([sample_losses(network.decode(encoding, z), batch) for z in tries])
    best = losses.argmin(0)
    return torch.stack(tries)[best, torch.arange(len(best))]


class Run:
    """The state of a training run, all that a checkpoint holds."""

    def __init__(self, config: TrainConfig, shape: NetworkConfig, out: Path) -> None:
        torch.manual_seed(config.seed)
        self.config, self.shape, self.out = config, shape, out
        # On processors without bf16, 3D convolutions are a quarter faster channels last.
        self.network = SplashNetwork(shape).to(memory_format=torch.channels_last_3d)  # type: ignore[call-overload]
        self.average = copy.deepcopy(self.network).eval()
        self.optimiser = torch.optim.AdamW(
            parameter_groups(self.network, config.weight_decay), lr=config.rate, betas=(0.9, 0.99)
        )
        self.random = torch.Generator().manual_seed(config.seed)
        self.steps, self.seconds = 0, 0.0
        self.frozen = False  # batch norm uses its running statistics, as it will in use

    @property
    def path(self) -> Path:
        """Where the checkpoint lies."""
        return self.out / "checkpoint.pt"

    @property
    def progress(self) -> float:
        """Share of the run done, 0..1."""
        return min(self.seconds / (60 * self.config.minutes), 1.0)

    def save(self) -> None:
        """Write the checkpoint aside, then rename it into place."""
        aside = self.path.with_suffix(".tmp")
        state = {
            "network": self.network.state_dict(),
            "average": self.average.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "random": self.random.get_state(),
            "steps": self.steps,
            "seconds": self.seconds,
            "frozen": self.frozen,
            "config": asdict(self.config),
            "shape": asdict(self.shape),
        }
        torch.save(state, aside)
        os.replace(aside, self.path)

    def load(self) -> None:
        """Go on from the checkpoint, if there is one."""
        if not self.path.exists():
            return
        state = torch.load(self.path, weights_only=True)
        self.network.load_state_dict(state["network"])
        self.average.load_state_dict(state["average"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.random.set_state(state["random"])
        self.steps, self.seconds = state["steps"], state["seconds"]
        self.frozen = state.get("frozen", False)

    def set_rate(self) -> float:
        """Set and return the learning rate: warm-up, constant, then 1 - sqrt decay."""
        config = self.config
        rate = config.rate * min((self.steps + 1) / config.warmup, 1.0)
        late = (self.progress - (1 - config.decay)) / config.decay
        if late > 0:
            rate *= 1 - min(late, 1.0) ** 0.5
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        return rate

    def step(self, batch: Batch) -> float:
        """Train on one batch; return its mean loss."""
        config = self.config
        self.set_rate()
        self.network.train(not self.frozen)
        encoding = self.network.encode(batch.condition, batch.scale)
        latent = None
        lot = torch.rand((), generator=self.random).item()
        if self.progress >= config.imle_from and lot >= config.deterministic:
            tries = [
                random_latents(self.shape, batch, self.random) for _ in range(config.candidates)
            ]
            latent = best_latents(self.network, encoding, batch, tries)
        loss = sample_losses(self.network.decode(encoding, latent), batch).mean()
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
        self.optimiser.step()
        self.steps += 1
        self.follow()
        return float(loss.detach())

    @torch.no_grad()
    def follow(self) -> None:
        """Move the averaged weights towards the trained ones; copy the statistics."""
        keep = min(self.config.average, self.steps / (self.steps + 10))
        for mine, new in zip(self.average.parameters(), self.network.parameters(), strict=True):
            mine.lerp_(new, 1 - keep)
        for mine, new in zip(self.average.buffers(), self.network.buffers(), strict=True):
            mine.copy_(new)


def parameter_groups(network: SplashNetwork, weight_decay: float) -> list[dict[str, Any]]:
    """Return the parameters in two groups: only convolution weights decay."""
    weights = [p for p in network.parameters() if p.ndim > 1]
    others = [p for p in network.parameters() if p.ndim <= 1]
    return [
        {"params": weights, "weight_decay": weight_decay},
        {"params": others, "weight_decay": 0.0},
    ]


@torch.no_grad()
def settle_norm(network: SplashNetwork, batches: Iterator[Batch], count: int) -> None:
    """Replace batch norm's running statistics by those of the present weights.

    A batch's own statistics depend on how much air its boxes hold, so a network must be
    trained, at the end, and used with common ones.
    """
    norms = [m for m in network.modules() if isinstance(m, torch.nn.BatchNorm3d)]
    for norm in norms:
        norm.reset_running_stats()
        norm.momentum = None  # a plain mean over the batches below
    network.train()
    for _ in range(count):
        batch = next(batches)
        network(batch.condition, batch.scale)
    network.eval()


def train(run: Run, items: list[Item], workers: int = 1) -> None:
    """Train until the run's time is up, with a progress bar and TensorBoard curves."""
    from torch.utils.tensorboard import SummaryWriter

    config = run.config
    if run.progress >= 1:
        return  # the statistics of a finished run are settled
    stream = Stream(items, config.seed + run.steps, config.cells)
    loader = DataLoader(stream, config.batch, num_workers=workers, collate_fn=collate)
    writer = SummaryWriter(str(run.out))
    before, saved, smooth = time.monotonic(), time.monotonic(), None
    bar = tqdm(total=round(config.minutes * 60), initial=round(run.seconds), unit="s")
    batches = iter(loader)
    while run.progress < 1:
        if run.progress >= config.freeze_from and not run.frozen:
            settle_norm(run.network, batches, SETTLING)
            run.frozen = True
        batch = next(batches)
        loss = run.step(batch)
        smooth = loss if smooth is None else 0.98 * smooth + 0.02 * loss
        now = time.monotonic()
        run.seconds += now - before
        bar.update(round(run.seconds) - bar.n)
        rate = config.batch / (now - before)
        before = now
        bar.set_postfix_str(f"loss {smooth:.3f}, {rate:.1f} samples/s, step {run.steps}")
        if run.steps % 20 == 0:
            writer.add_scalar("loss", smooth, run.steps)
        if now - saved > 60 * config.checkpoint:
            run.save()
            saved = now
    bar.close()
    settle_norm(run.average, batches, SETTLING)
    run.save()
    writer.close()


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--out", type=Path, required=True, help="directory of the run")
    parser.add_argument("--workers", type=int, default=1, help="processes that prepare samples")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    for item in fields(TrainConfig):
        parser.add_argument(
            f"--{item.name.replace('_', '-')}", type=type(item.default), default=item.default
        )
    args = parser.parse_args()
    config = TrainConfig(**{item.name: getattr(args, item.name) for item in fields(TrainConfig)})
    torch.set_num_threads(args.threads)
    try:
        items = load_items(args.data, "train")
        args.out.mkdir(parents=True, exist_ok=True)
        run = Run(config, NetworkConfig(), args.out)
        run.load()
        train(run, items, args.workers)
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
