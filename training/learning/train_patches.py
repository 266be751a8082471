# SPDX-License-Identifier: GPL-3.0-or-later
"""Train the patch classifier, before the generator that is shown its verdicts.

    python -m training train-patches DATA --minutes 15

Writes the add-on's weights of it, and prints how well it tells patches in liquid from others.
"""

from __future__ import annotations

import copy
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import torch
from torch.nn import functional as F
from tqdm import tqdm

from liquid_splash_addon.core.generator.patch_classifier import (
    GraphTensors,
    PatchClassifier,
    patch_classifier_path,
    save_patch_classifier,
)

from ..command_line import PROGRESS_BAR, command_parser
from ..data.items import choose, load_items, scenes_digest
from .labelled_patches import LabelledPatches, label_all
from .optimising import follow

LEARNING_RATE = 2e-3
"""AdamW's; falls to zero over the run."""

SKETCHES_A_STEP = 4

WARM_UP = 50
"""Steps over which the learning rate rises at first."""

AVERAGE_KEPT = 0.995
"""Share of the weights' moving average that is kept at each step (EMA)."""

NEAR_WEIGHT = 0.3
"""Weight of the second answer's loss: what lies in liquid matters, what lies near it is easier."""

Figures = dict[str, float]
"""Figures by name."""


def loss_of(classifier: PatchClassifier, sketch: LabelledPatches) -> torch.Tensor:
    """Cross-entropy of both answers, each triangle weighted by how many samples it has."""
    logits = classifier(GraphTensors.of(sketch.graph))
    weight = torch.from_numpy(sketch.samples / sketch.samples.sum())
    inside, near = (
        F.binary_cross_entropy_with_logits(
            logits[:, i], torch.from_numpy(truth), weight, reduction="sum"
        )
        for i, truth in enumerate((sketch.inside, sketch.near))
    )
    return inside + NEAR_WEIGHT * near


def new_classifier(sketches: Sequence[LabelledPatches]) -> PatchClassifier:
    """Return an untrained classifier that scales the features of these sketches to variance 1."""
    classifier = PatchClassifier()
    graphs = [sketch.graph for sketch in sketches]
    for name, parts in (
        ("knots", [graph.points for graph in graphs]),  # as the tensors are named
        ("triangles", [graph.triangles for graph in graphs]),
    ):
        every = np.concatenate(parts)
        getattr(classifier, f"mean_{name}").copy_(torch.from_numpy(every.mean(axis=0)))
        getattr(classifier, f"scale_{name}").copy_(torch.from_numpy(every.std(axis=0) + 1e-3))
    return classifier


def train(
    sketches: Sequence[LabelledPatches], minutes: float, steps_in_all: int = 0, seed: int = 0
) -> PatchClassifier:
    """Return the moving average of a classifier that is trained for so many minutes.

    steps_in_all : ends the training after so many steps instead, if not 0
    """
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    classifier = new_classifier(sketches)
    average = copy.deepcopy(classifier).eval()
    optimiser = torch.optim.AdamW(classifier.parameters(), LEARNING_RATE, weight_decay=1e-2)
    begun, steps = time.monotonic(), 0
    bar = tqdm(total=1.0, bar_format=PROGRESS_BAR)

    def done() -> float:
        if steps_in_all:
            return steps / steps_in_all
        return (time.monotonic() - begun) / (60 * minutes)

    while (progress := done()) < 1:
        for group in optimiser.param_groups:
            group["lr"] = LEARNING_RATE * min((steps + 1) / WARM_UP, 1.0) * (1 - progress)
        optimiser.zero_grad()
        chosen = rng.integers(len(sketches), size=SKETCHES_A_STEP)
        loss = torch.stack([loss_of(classifier, sketches[i]) for i in chosen]).mean()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(classifier.parameters(), 1.0)
        optimiser.step()
        steps += 1
        follow(average, classifier, AVERAGE_KEPT, steps)
        bar.update(progress - bar.n)
        bar.set_postfix_str(f"loss {loss.item():.3f}, step {steps}")
    bar.close()
    return average


def tell_apart(scores: np.ndarray, inside: np.ndarray, samples: np.ndarray) -> Figures:
    """Return how well ``scores`` tell triangles in liquid from others; all ``(m,)``.

    inside : share of each one's samples that lies in liquid; samples : how many it has.

    'auc' : probability that of a sample in liquid and one in air the first has the higher score;
    'precision' : mean precision over all recalls.
    """
    order = np.argsort(-scores, kind="stable")
    wet, dry = (samples * inside)[order], (samples * (1 - inside))[order]
    found, wrong = np.cumsum(wet), np.cumsum(dry)
    auc = 1 - float((wet * (wrong - dry / 2)).sum() / (found[-1] * wrong[-1]))
    precision = float((found / (found + wrong) * wet).sum() / found[-1])
    return {"auc": auc, "precision": precision}


def figures_of(
    sketches: Sequence[LabelledPatches], score: Callable[[LabelledPatches], np.ndarray]
) -> Figures:
    """Return :func:`tell_apart` over all triangles of all sketches."""
    parts = [(score(sketch), sketch.inside, sketch.samples) for sketch in sketches]
    scores, inside, samples = (np.concatenate(part) for part in zip(*parts, strict=True))
    return tell_apart(scores, inside, samples)


def report(classifier: PatchClassifier, sketches: Sequence[LabelledPatches]) -> dict[str, Figures]:
    """Return the figures of the classifier ('judged', as files have it) and of the radius alone."""
    return {
        "judged": figures_of(sketches, lambda sketch: classifier.classify(sketch.graph)[:, 0]),
        "radius": figures_of(sketches, lambda sketch: -sketch.graph.triangles[:, 0]),
    }


def main(arguments: Sequence[str]) -> int:
    """Run the command."""
    parser = command_parser("train-patches", __doc__)
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--out", type=Path, default=patch_classifier_path())
    parser.add_argument("--minutes", type=float, default=15.0)
    parser.add_argument("--sketches", type=int, default=2, help="of each training frame")
    parser.add_argument("--most", type=int, default=200, help="validation frames at the most")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    args = parser.parse_args(arguments)
    torch.set_num_threads(args.threads)
    try:
        items = load_items(args.data, "train")
        held_out = choose(load_items(args.data, "validation"), args.most)
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    classifier = train(label_all(items, range(args.sketches), args.workers), args.minutes)
    figures = report(classifier, label_all(held_out, [None], args.workers))
    about: dict[str, object] = {"figures": figures, "data_hash": scenes_digest(items).hexdigest()}
    save_patch_classifier(classifier, args.out, about)
    print(json.dumps(figures, indent=1))
    return 0
