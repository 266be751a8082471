# SPDX-License-Identifier: GPL-3.0-or-later
"""Train what judges spans, before the generator that is shown its judgement.

    python -m training.train_spans DATA --minutes 15

Writes the add-on's weights of it, and how well it tells spans in liquid from others.
"""

from __future__ import annotations

import argparse
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

from ..data.dataset import choose, load_items, scenes_digest
from .optimising import follow
from .patch_samples import SpanLesson, span_lessons

LEARNING_RATE = 2e-3  # AdamW's; falls to zero over the run
SKETCHES_A_STEP = 4
WARM_UP = 50  # steps
AVERAGE = 0.995  # of the weights (EMA), per step
NEAR_WEIGHT = 0.3
"""Weight of the second answer's loss: in liquid is what matters, near it is easier."""

Figures = dict[str, float]


def loss_of(judge: PatchClassifier, lesson: SpanLesson) -> torch.Tensor:
    """Return the cross-entropy of both answers, each triangle by how many samples it has."""
    logits = judge(GraphTensors.of(lesson.graph))
    weight = torch.from_numpy(lesson.samples / lesson.samples.sum())
    inside, near = (
        F.binary_cross_entropy_with_logits(
            logits[:, i], torch.from_numpy(truth), weight, reduction="sum"
        )
        for i, truth in enumerate((lesson.inside, lesson.near))
    )
    return inside + NEAR_WEIGHT * near


def new_judge(lessons: Sequence[SpanLesson]) -> PatchClassifier:
    """Return an untrained judge to which the features of these lessons are of variance 1."""
    judge = PatchClassifier()
    graphs = [lesson.graph for lesson in lessons]
    for name, parts in (
        ("knots", [graph.points for graph in graphs]),  # as the tensors are named
        ("triangles", [graph.triangles for graph in graphs]),
    ):
        every = np.concatenate(parts)
        getattr(judge, f"mean_{name}").copy_(torch.from_numpy(every.mean(axis=0)))
        getattr(judge, f"scale_{name}").copy_(torch.from_numpy(every.std(axis=0) + 1e-3))
    return judge


def train(
    lessons: Sequence[SpanLesson], minutes: float, steps_in_all: int = 0, seed: int = 0
) -> PatchClassifier:
    """Return a judge trained on ``lessons`` for so many minutes, its moving average.

    steps_in_all : ends the training after so many steps instead, if not 0.
    """
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    judge = new_judge(lessons)
    average = copy.deepcopy(judge).eval()
    optimiser = torch.optim.AdamW(judge.parameters(), LEARNING_RATE, weight_decay=1e-2)
    begun, steps = time.monotonic(), 0
    bar = tqdm(total=1.0, bar_format="{percentage:3.0f}%|{bar}| {elapsed}<{remaining} {postfix}")

    def done() -> float:
        if steps_in_all:
            return steps / steps_in_all
        return (time.monotonic() - begun) / (60 * minutes)

    while (progress := done()) < 1:
        for group in optimiser.param_groups:
            group["lr"] = LEARNING_RATE * min((steps + 1) / WARM_UP, 1.0) * (1 - progress)
        optimiser.zero_grad()
        chosen = rng.integers(len(lessons), size=SKETCHES_A_STEP)
        loss = torch.stack([loss_of(judge, lessons[i]) for i in chosen]).mean()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(judge.parameters(), 1.0)
        optimiser.step()
        steps += 1
        follow(average, judge, AVERAGE, steps)
        bar.update(progress - bar.n)
        bar.set_postfix_str(f"loss {loss.item():.3f}, step {steps}")
    bar.close()
    return average


def tell_apart(scores: np.ndarray, inside: np.ndarray, samples: np.ndarray) -> Figures:
    """Return how well ``scores`` tell triangles in liquid from others.

    'auc' : how likely of a sample in liquid and one in air, the first has the higher score;
    'precision' : the mean precision over all recalls. All by samples, ``(m,)`` each.
    """
    order = np.argsort(-scores, kind="stable")
    wet, dry = (samples * inside)[order], (samples * (1 - inside))[order]
    found, wrong = np.cumsum(wet), np.cumsum(dry)
    auc = 1 - float((wet * (wrong - dry / 2)).sum() / (found[-1] * wrong[-1]))
    precision = float((found / (found + wrong) * wet).sum() / found[-1])
    return {"auc": auc, "precision": precision}


def figures_of(lessons: Sequence[SpanLesson], score: Callable[[SpanLesson], np.ndarray]) -> Figures:
    """Return :func:`tell_apart` over all triangles of all lessons."""
    parts = [(score(lesson), lesson.inside, lesson.samples) for lesson in lessons]
    scores, inside, samples = (np.concatenate(part) for part in zip(*parts, strict=True))
    return tell_apart(scores, inside, samples)


def report(judge: PatchClassifier, lessons: Sequence[SpanLesson]) -> dict[str, Figures]:
    """Return the figures of ``judge`` and of the radius alone."""
    return {
        "judged": figures_of(lessons, lambda lesson: judge.classify(lesson.graph)[:, 0]),
        "radius": figures_of(lessons, lambda lesson: -lesson.graph.triangles[:, 0]),
    }


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path, help="directory of the data set")
    parser.add_argument("--out", type=Path, default=patch_classifier_path())
    parser.add_argument("--minutes", type=float, default=15.0)
    parser.add_argument("--sketches", type=int, default=2, help="of each training frame")
    parser.add_argument("--most", type=int, default=200, help="validation frames at the most")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    args = parser.parse_args()
    torch.set_num_threads(args.threads)
    try:
        items = load_items(args.data, "train")
        held_out = choose(load_items(args.data, "validation"), args.most)
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1
    judge = train(span_lessons(items, range(args.sketches), args.workers), args.minutes)
    figures = report(judge, span_lessons(held_out, [None], args.workers))
    about = {"figures": figures, "data_hash": scenes_digest(items).hexdigest()}
    save_patch_classifier(judge, args.out, {"header": json.dumps(about)})
    print(json.dumps(figures, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
