# SPDX-License-Identifier: GPL-3.0-or-later
"""Which spans of a sketch lie in liquid: a small graph network over all of them.

Half of the spans of a splash's strokes are sheets of it, the others cross air. What tells them
apart is how they lie to each other: whether one goes on where the next ends, and what the
strokes around it do. Messages go from triangle to triangle, to the knots and along the strokes.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from ..condition.patches.features import SpanGraph
from .weights_file import check_format, damaged, default_weights_path, read_file, read_metadata

KNOT_FEATURES, TRIANGLE_FEATURES, PAIR_FEATURES = 14, 32, 4

LIMIT = 5.0
"""Standard deviations that no feature is beyond."""

FORMAT = "liquid-splash-spans-1"


class Graph(NamedTuple):
    """A :class:`SpanGraph` as tensors."""

    knots: Tensor
    triangles: Tensor
    corners: Tensor
    before: Tensor
    after: Tensor
    source: Tensor
    target: Tensor
    pairs: Tensor

    @classmethod
    def of(cls, graph: SpanGraph) -> Graph:
        """Return the tensors of a graph; they share its memory."""
        return cls(*(torch.from_numpy(np.ascontiguousarray(part)) for part in graph))


def mean_and_most(x: Tensor, where: Tensor, count: int) -> Tensor:
    """Return the mean and the greatest of the rows that go to each of ``count`` places.

    x : ``(n, C)``, none negative; where : ``(n,)``. The result is ``(count, 2 C)``, zero where
    no row goes.
    """
    total = x.new_zeros(count, x.shape[1]).index_add(0, where, x)
    rows = torch.bincount(where, minlength=count).clamp_min(1)
    most = x.new_zeros(count, x.shape[1]).scatter_reduce(
        0, where[:, None].expand_as(x), x, "amax", include_self=True
    )
    return torch.cat([total / rows[:, None], most], dim=1)


def two_layers(inputs: int, outputs: int) -> nn.Sequential:
    """Return a perceptron with one hidden layer, as wide as its result."""
    return nn.Sequential(nn.Linear(inputs, outputs), nn.ReLU(), nn.Linear(outputs, outputs))


class Exchange(nn.Module):
    """One round of messages: triangles -> knots, along strokes; triangles -> triangles."""

    def __init__(self, width: int) -> None:
        super().__init__()
        # The first layer of the messages, on each triangle once instead of on each pair.
        self.source = nn.Linear(width, width, bias=False)
        self.target = nn.Linear(width, width)
        self.pair = nn.Linear(PAIR_FEATURES, width, bias=False)
        self.message = nn.Linear(width, width)
        self.to_knots = two_layers(5 * width, width)
        self.to_triangles = two_layers(5 * width, width)
        self.knots_norm, self.triangles_norm = nn.LayerNorm(width), nn.LayerNorm(width)

    def forward(self, knots: Tensor, triangles: Tensor, graph: Graph) -> tuple[Tensor, Tensor]:
        """Return the new features of knots ``(n, C)`` and triangles ``(m, C)``."""
        corner = graph.corners.flatten()
        given = mean_and_most(torch.relu(triangles).repeat_interleave(3, 0), corner, len(knots))
        beside = [knots.index_select(0, next_one) for next_one in (graph.before, graph.after)]
        knots = self.knots_norm(knots + self.to_knots(torch.cat([knots, given, *beside], dim=1)))
        message = self.source(triangles).index_select(0, graph.source)
        message = message + self.target(triangles).index_select(0, graph.target)
        message = torch.relu(self.message(torch.relu(message + self.pair(graph.pairs))))
        met = mean_and_most(message, graph.target, len(triangles))
        held = knots.index_select(0, corner).view(*graph.corners.shape, -1)  # (m, 3, C)
        around = torch.cat([triangles, held.mean(1), held.amax(1), met], dim=1)
        return knots, self.triangles_norm(triangles + self.to_triangles(around))


class SpanJudge(nn.Module):
    """Graph -> two logits for each triangle: it lies in liquid; within a cell of it (128^3)."""

    mean_knots: Tensor
    scale_knots: Tensor
    mean_triangles: Tensor
    scale_triangles: Tensor

    def __init__(self, width: int = 48, rounds: int = 4) -> None:
        super().__init__()
        for name, size in (("knots", KNOT_FEATURES), ("triangles", TRIANGLE_FEATURES)):
            self.register_buffer(f"mean_{name}", torch.zeros(size))
            self.register_buffer(f"scale_{name}", torch.ones(size))
        self.knots = nn.Linear(KNOT_FEATURES, width)
        self.triangles = nn.Linear(TRIANGLE_FEATURES, width)
        self.rounds = nn.ModuleList(Exchange(width) for _ in range(rounds))
        self.head = nn.Linear(width, 2)

    def forward(self, graph: Graph) -> Tensor:
        """Return the logits ``(m, 2)``."""
        knots = (graph.knots - self.mean_knots) / self.scale_knots
        triangles = (graph.triangles - self.mean_triangles) / self.scale_triangles
        knots = torch.relu(self.knots(knots.clamp(-LIMIT, LIMIT)))
        triangles = torch.relu(self.triangles(triangles.clamp(-LIMIT, LIMIT)))
        for exchange in self.rounds:
            knots, triangles = exchange(knots, triangles, graph)
        logits: Tensor = self.head(triangles)
        return logits

    @torch.inference_mode()
    def judge(self, graph: SpanGraph) -> np.ndarray:
        """Return how likely each triangle lies in liquid, and within a cell of it, ``(m, 2)``.

        On one thread: its arrays are small, and threads that met at each took thrice as long.
        """
        threads = torch.get_num_threads()
        torch.set_num_threads(1)
        try:
            judged: np.ndarray = torch.sigmoid(self(Graph.of(graph))).numpy()
        finally:
            torch.set_num_threads(threads)
        return judged


def judge_path() -> Path:
    """Return where the bundled weights of it lie."""
    return default_weights_path().with_name("spans.safetensors")


@lru_cache(maxsize=1)
def bundled_judge() -> SpanJudge:
    """Return the bundled judge; WeightsError if it is missing or damaged."""
    return load_judge(judge_path())


def load_judge(path: Path) -> SpanJudge:
    """Return the judge stored at ``path``; WeightsError if it is missing, damaged or not one."""
    from safetensors import SafetensorError
    from safetensors.torch import load

    judge, data = SpanJudge(), read_file(path)
    check_format(read_metadata(data, path), FORMAT, path)
    try:
        tensors = load(data)
        judge.load_state_dict({name: tensor.float() for name, tensor in tensors.items()})
    except (SafetensorError, RuntimeError) as error:
        raise damaged(path) from error
    return judge.eval()


def save_judge(judge: SpanJudge, path: Path, about: dict[str, str]) -> None:
    """Write a judge as float16, with ``about`` beside it."""
    from safetensors.torch import save_file

    tensors = {k: v.to(torch.float16).contiguous() for k, v in judge.state_dict().items()}
    save_file(tensors, path, {"format": FORMAT, **about})
