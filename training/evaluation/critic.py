# SPDX-License-Identifier: GPL-3.0-or-later
"""Train a critic to tell simulated surfaces from generated ones, and measure it on test scenes.

    python -m training critic DATA --out RUN --minutes 30

A small 3D network sees crops of surfaces, simulated and generated, of training scenes. Its AUC on
scenes that it never saw says how different both look to it: 0.5 if not at all. Twins, the same
scenes simulated again, are as simulated as the truth: what their AUC is off 0.5 is the floor. Crops
are kept in RUN, and so is the network: the same command goes on where a stopped run was.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from scipy.ndimage import gaussian_filter
from scipy.stats import rankdata
from torch import Tensor, nn
from tqdm import tqdm

from liquid_splash_addon.core.fluid.surface import redistance
from liquid_splash_addon.core.generator.weights_file import default_weights_path
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import AIR
from liquid_splash_addon.core.liquid.level_set import surface_level
from liquid_splash_addon.core.mesh.marching_cubes import LEVEL_BAND, LEVEL_SPREAD
from liquid_splash_addon.core.sketch.local_frame import fit_frame

from ..command_line import command_parser
from ..data.items import Item, choose, load_items
from ..data.samples import held_out_sample, held_out_strokes, resample
from ..learning.thresholds import Answer
from .answers import latents_for, load_answer
from .ceiling import twin_frames

SIDE = 32
"""Cells of a crop: bumps, rims and sheets are seen, whole splashes are not."""

CROPS = 12
"""Of each frame, simulated and generated."""

RATE, BATCH = 4e-3, 32
"""Learning rate at the start, crops a step."""

CODES = 40
"""Steps a cell in which crops are kept."""


def seen(level: np.ndarray) -> np.ndarray:
    """Return the distance to the surface that is meshed, cells, clipped at +-AIR, ``(X, Y, Z)``.

    Levels of the truth and of answers differ everywhere; only their surfaces are to be compared.
    """
    near = np.clip(level, -LEVEL_BAND, LEVEL_BAND)
    blurred = gaussian_filter(near, LEVEL_SPREAD, mode="nearest").astype(np.float32)
    return np.asarray(redistance(np.pad(blurred, 1, mode="edge"), AIR)[1:-1, 1:-1, 1:-1])


def crops_of(level: np.ndarray, rng: np.random.Generator, count: int = CROPS) -> np.ndarray:
    """Return ``count`` crops around cells at the surface, int8 ``(count, SIDE, SIDE, SIDE)``.

    Without liquid there are none.
    """
    distance = np.pad(seen(level), SIDE // 2, constant_values=AIR)
    places = np.argwhere(np.abs(distance) < 0.7)
    if not len(places):
        return np.zeros((0, SIDE, SIDE, SIDE), dtype=np.int8)
    corners = places[rng.integers(len(places), size=count)] - SIDE // 2
    corners = np.clip(corners, 0, np.array(distance.shape) - SIDE)
    parts = [distance[x : x + SIDE, y : y + SIDE, z : z + SIDE] for x, y, z in corners]
    return np.round(CODES * np.stack(parts)).astype(np.int8)


def prepare(item: Item, answer: Answer, path: Path) -> None:
    """Write the crops of a frame and of the answer to its sketch, if they are not there yet."""
    if path.exists():
        return
    sample, _ = held_out_sample(item, Grid.local().shape[0])
    rng = np.random.default_rng([item.seed, item.number, 1])
    latent = latents_for(answer, 8)[(item.seed + item.number) % 8]
    level = surface_level(answer.generate(sample.condition, sample.grid, latent), 0.5)
    write_crops(path, crops_of(sample.distance, rng), crops_of(level, rng))


def prepare_twins(items: Sequence[Item], path: Path) -> None:
    """Write crops of a scene's frames and of its twin's, if they are not there yet."""
    if path.exists():
        return
    found: list[list[np.ndarray]] = [[], []]
    for item, twin in twin_frames(items):
        stored = item.load()
        frame = fit_frame(held_out_strokes(item, stored))
        rng = np.random.default_rng([item.seed, item.number, 2])
        for crops, liquid in zip(found, (stored, twin), strict=True):
            level, _ = resample(liquid, item.spacing, frame, Grid.local())
            crops.append(crops_of(level, rng))
    empty = np.zeros((0, SIDE, SIDE, SIDE), dtype=np.int8)
    write_crops(path, *(np.concatenate([empty, *crops]) for crops in found))


def write_crops(path: Path, simulated: np.ndarray, others: np.ndarray) -> None:
    """Write crops aside, then rename the file into place."""
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_suffix(".tmp.npz")
    np.savez_compressed(aside, simulated=simulated, others=others)
    aside.replace(path)


def read_crops(paths: Sequence[Path]) -> tuple[np.ndarray, np.ndarray]:
    """Return all crops of the files ``(n, SIDE, SIDE, SIDE)``, and whether each is simulated."""
    found, labels = [], []
    for path in paths:
        with np.load(path) as data:
            for name in ("simulated", "others"):
                found.append(data[name])
                labels.append(np.full(len(data[name]), name == "simulated"))
    return np.concatenate(found), np.concatenate(labels)


class Critic(nn.Module):
    """Crops of :func:`as_input` to logits ``(B,)`` of being simulated.

    Features are averaged over the cells near the surface: most others say nothing.
    """

    def __init__(self) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        before = 2
        for size, stride, after in ((5, 2, 16), (3, 1, 16), (3, 2, 32)):
            conv = nn.Conv3d(before, after, size, stride, size // 2, bias=False)
            layers += [conv, nn.BatchNorm3d(after), nn.LeakyReLU(0.1)]
            before = after
        self.features = nn.Sequential(*layers)
        self.head = nn.Sequential(nn.Linear(before, 32), nn.ReLU(), nn.Linear(32, 1))

    def forward(self, crops: Tensor) -> Tensor:
        """Return the logits."""
        features = self.features(crops)
        near = nn.functional.adaptive_avg_pool3d(
            (crops[:, :1].abs() < 1).float(), features.shape[2:]
        )
        total = near.sum((2, 3, 4)).clamp_min(1e-3)
        pooled = (features * near).sum((2, 3, 4)) / total
        return torch.as_tensor(self.head(pooled)[:, 0])


def turned(crops: Tensor, rng: np.random.Generator) -> Tensor:
    """Return crops ``(B, C, n, n, n)`` in one of a cube's 48 orientations."""
    axes = [2 + int(axis) for axis in rng.permutation(3)]
    mirrored = [axis for axis in (2, 3, 4) if rng.random() < 0.5]
    return crops.permute(0, 1, *axes).flip(mirrored)


def as_input(crops: np.ndarray) -> Tensor:
    """Return crops as the network takes them: distance, and its Laplacian near the surface.

    The second is twice the mean curvature, in 1 / cell: bumps and rims stand out in it at once.
    """
    distance = torch.from_numpy(crops.astype(np.float32) / CODES)[:, None]
    around = nn.functional.pad(distance, (1,) * 6, mode="replicate")
    total = -6 * distance
    for axis in (2, 3, 4):
        for shift in (0, 2):
            part = around.narrow(axis, shift, SIDE)
            for other in {2, 3, 4} - {axis}:
                part = part.narrow(other, 1, SIDE)
            total = total + part
    bent = torch.where(distance.abs() < LEVEL_BAND, total, 0.0)
    return torch.cat([distance.clamp(-LEVEL_BAND, LEVEL_BAND), bent], dim=1)


def train(
    crops: np.ndarray, labels: np.ndarray, path: Path, minutes: float, most: int = 0
) -> nn.Module:
    """Train the network for so many minutes in all, going on from its checkpoint; return it.

    most : ends the run after so many steps instead, if not 0
    """
    torch.manual_seed(0)
    network = Critic()
    optimiser = torch.optim.AdamW(network.parameters(), RATE, weight_decay=1e-2)
    seconds, steps = 0.0, 0
    if path.exists():
        state = torch.load(path, weights_only=True)
        network.load_state_dict(state["network"])
        optimiser.load_state_dict(state["optimiser"])
        seconds, steps = state["seconds"], state["steps"]
    saved = seconds
    while (done := steps / most if most else seconds / (60 * minutes)) < 1:
        begun = time.monotonic()
        rng = np.random.default_rng([steps, 3])
        for group in optimiser.param_groups:
            group["lr"] = RATE * (1 - done) ** 0.5
        chosen = rng.integers(len(crops), size=BATCH)
        logits = network(turned(as_input(crops[chosen]), rng))
        truth = torch.from_numpy(labels[chosen].astype(np.float32))
        loss = nn.functional.binary_cross_entropy_with_logits(logits, truth)
        optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        steps, seconds = steps + 1, seconds + time.monotonic() - begun
        is_last = steps == most if most else seconds >= 60 * minutes
        if seconds - saved > 60 or is_last:
            state = {"network": network.state_dict(), "optimiser": optimiser.state_dict()}
            torch.save({**state, "seconds": seconds, "steps": steps}, path.with_suffix(".tmp"))
            path.with_suffix(".tmp").replace(path)
            saved = seconds
    return network.eval()


@torch.inference_mode()
def scores(network: nn.Module, crops: np.ndarray) -> np.ndarray:
    """Return the network's logit of each crop, ``(n,)``."""
    parts = [network(as_input(crops[n : n + 64])) for n in range(0, len(crops), 64)]
    return torch.cat(parts).numpy() if parts else np.zeros(0)


def auc(values: np.ndarray, labels: np.ndarray) -> float:
    """Return the chance that one of the labelled scores above one that is not; NaN without both.

    Ties count as half: the Mann-Whitney statistic.
    """
    yes, no = int(labels.sum()), int((~labels).sum())
    if not (yes and no):
        return float("nan")
    above = rankdata(values)[labels].sum() - yes * (yes + 1) / 2
    return float(above / (yes * no))


def run(args: argparse.Namespace) -> dict[str, float]:
    """Prepare, train and measure; return the figures. ValueError where there are no frames."""
    answer = load_answer(args.model)
    files: dict[str, list[Path]] = {}
    for split, most in (("train", args.frames), ("test", args.tests)):
        for item in tqdm(choose(load_items(args.data, split), most), desc=split, unit="frame"):
            path = args.out / split / f"{item.seed}_{item.number}.npz"
            prepare(item, answer, path)
            files.setdefault(split, []).append(path)
    scenes: dict[int, list[Item]] = {}
    for item in load_items(args.data, "test"):
        scenes.setdefault(item.seed, []).append(item)
    for seed in tqdm(list(scenes)[: args.twins], desc="twins", unit="scene"):
        path = args.out / "twins" / f"{seed}.npz"
        prepare_twins(scenes[seed], path)
        files.setdefault("twins", []).append(path)
    crops, labels = read_crops(files["train"])
    network = train(crops, labels, args.out / "critic.pt", args.minutes)
    figures: dict[str, float] = {"training_crops": len(crops)}
    for name, paths in files.items():
        crops, labels = read_crops(paths)
        figures[f"auc_{name}"] = auc(scores(network, crops), labels)
    return figures


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("critic", __doc__)
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--out", type=Path, required=True, help="directory of the run")
    parser.add_argument("--model", type=Path, default=default_weights_path(), help="weights or run")
    parser.add_argument("--frames", type=int, default=240, help="training frames at the most")
    parser.add_argument("--tests", type=int, default=40, help="test frames at the most")
    parser.add_argument("--twins", type=int, default=4, help="test scenes that are simulated again")
    parser.add_argument("--minutes", type=float, default=30.0, help="of training the critic")
    args = parser.parse_args(arguments)
    try:
        figures = run(args)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    (args.out / "critic.json").write_text(json.dumps(figures, indent=1) + "\n")
    print("\n".join(f"{name:16} {value:.3f}" for name, value in figures.items()))
    return 0
