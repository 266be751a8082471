# SPDX-License-Identifier: GPL-3.0-or-later
"""Which patches of a sketch lie in liquid: a small graph network over all of them.

Half of the patches between a splash's strokes are sheets of it, the others cross air. What tells
them apart is how they lie relative to each other: whether one continues the next, and what the
strokes around them do. Messages go from triangle to triangle, to the sample points and along the
strokes.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from ..condition.patches.features import (
    EDGE_FEATURES,
    POINT_FEATURES,
    TRIANGLE_FEATURES,
    PatchGraph,
    patch_graph,
)
from ..condition.patches.gabriel import find_patches, sample_points_of
from ..condition.patches.sampling import PatchSamples, sample_patches
from ..sketch.strokes import Stroke
from .weights_file import (
    check_format,
    check_names,
    damaged,
    default_weights_path,
    read_file,
    read_metadata,
    tensors_hash,
)

FEATURE_LIMIT = 5.0
"""Standard deviations at which features are clipped."""

CLASSIFIER_FORMAT = "liquid-splash-spans-1"

FEATURES = {
    "point_features": list(POINT_FEATURES),
    "triangle_features": list(TRIANGLE_FEATURES),
    "edge_features": list(EDGE_FEATURES),
}
"""What a file's header says of the columns that its weights are for."""


class GraphTensors(NamedTuple):
    """A :class:`PatchGraph` as tensors."""

    points: Tensor
    triangles: Tensor
    corners: Tensor
    before: Tensor
    after: Tensor
    source: Tensor
    target: Tensor
    pairs: Tensor

    @classmethod
    def of(cls, graph: PatchGraph) -> GraphTensors:
        """Return the tensors of a graph; they share its memory."""
        return cls(*(torch.from_numpy(np.ascontiguousarray(part)) for part in graph))


def mean_and_most(x: Tensor, where: Tensor, count: int) -> Tensor:
    """Return the mean and the maximum of the rows that go to each of ``count`` places.

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
    """One round of messages: triangles -> points, along strokes; triangles -> triangles."""

    def __init__(self, width: int) -> None:
        super().__init__()
        # The first layer of the messages, on each triangle once instead of on each pair.
        self.source = nn.Linear(width, width, bias=False)
        self.target = nn.Linear(width, width)
        self.pair = nn.Linear(len(EDGE_FEATURES), width, bias=False)
        self.message = nn.Linear(width, width)
        self.to_knots = two_layers(5 * width, width)
        self.to_triangles = two_layers(5 * width, width)
        self.knots_norm, self.triangles_norm = nn.LayerNorm(width), nn.LayerNorm(width)

    def forward(
        self, points: Tensor, triangles: Tensor, graph: GraphTensors
    ) -> tuple[Tensor, Tensor]:
        """Return the new features of points ``(n, C)`` and triangles ``(m, C)``."""
        corner = graph.corners.flatten()
        given = mean_and_most(torch.relu(triangles).repeat_interleave(3, 0), corner, len(points))
        beside = [points.index_select(0, next_one) for next_one in (graph.before, graph.after)]
        points = self.knots_norm(points + self.to_knots(torch.cat([points, given, *beside], dim=1)))
        message = self.source(triangles).index_select(0, graph.source)
        message = message + self.target(triangles).index_select(0, graph.target)
        message = torch.relu(self.message(torch.relu(message + self.pair(graph.pairs))))
        met = mean_and_most(message, graph.target, len(triangles))
        held = points.index_select(0, corner).view(*graph.corners.shape, -1)  # (m, 3, C)
        around = torch.cat([triangles, held.mean(1), held.amax(1), met], dim=1)
        return points, self.triangles_norm(triangles + self.to_triangles(around))


class PatchClassifier(nn.Module):
    """Graph -> two logits for each triangle: it lies in liquid; within a cell of it (128^3).

    Sample points are "knots" in the names of tensors, which are a format and stay.

    Attributes
    ----------
    weights_hash : SHA-256 of the tensors of the file it came from, hexadecimal; "" if of none
    """

    weights_hash = ""

    mean_knots: Tensor
    scale_knots: Tensor
    mean_triangles: Tensor
    scale_triangles: Tensor

    def __init__(self, width: int = 48, rounds: int = 4) -> None:
        super().__init__()
        for name, size in (("knots", len(POINT_FEATURES)), ("triangles", len(TRIANGLE_FEATURES))):
            self.register_buffer(f"mean_{name}", torch.zeros(size))
            self.register_buffer(f"scale_{name}", torch.ones(size))
        self.knots = nn.Linear(len(POINT_FEATURES), width)
        self.triangles = nn.Linear(len(TRIANGLE_FEATURES), width)
        self.rounds = nn.ModuleList(Exchange(width) for _ in range(rounds))
        self.head = nn.Linear(width, 2)

    def forward(self, graph: GraphTensors) -> Tensor:
        """Return the logits ``(m, 2)``."""
        points = (graph.points - self.mean_knots) / self.scale_knots
        triangles = (graph.triangles - self.mean_triangles) / self.scale_triangles
        points = torch.relu(self.knots(points.clamp(-FEATURE_LIMIT, FEATURE_LIMIT)))
        triangles = torch.relu(self.triangles(triangles.clamp(-FEATURE_LIMIT, FEATURE_LIMIT)))
        for exchange in self.rounds:
            points, triangles = exchange(points, triangles, graph)
        logits: Tensor = self.head(triangles)
        return logits

    @torch.inference_mode()
    def classify(self, graph: PatchGraph) -> np.ndarray:
        """Return how likely each triangle lies in liquid, and within a cell of it, ``(m, 2)``.

        On one thread: the arrays are small, and synchronising threads for each took thrice as long.
        """
        threads = torch.get_num_threads()
        torch.set_num_threads(1)
        try:
            verdicts: np.ndarray = torch.sigmoid(self(GraphTensors.of(graph))).numpy()
        finally:
            torch.set_num_threads(threads)
        return verdicts


def patch_samples(strokes: Sequence[Stroke], classifier: PatchClassifier) -> PatchSamples:
    """Return samples of the patches between ``strokes``, each with the classifier's verdict.

    strokes : in local metres and m/s
    """
    samples = sample_points_of(strokes)
    patches = find_patches(samples)
    if not len(patches.triangles):
        return PatchSamples.none()
    verdicts = classifier.classify(patch_graph(samples, patches))
    return sample_patches(samples, patches, np.hstack([patches.quality, verdicts]))


def patch_classifier_path(generator: Path | None = None) -> Path:
    """Return where the classifier of a generator's weights lies: beside them, else the bundled one.

    generator : path of its weights, by default the bundled ones
    """
    bundled = default_weights_path().with_name("patch_classifier.safetensors")
    own = bundled if generator is None else generator.with_name(bundled.name)
    return own if own.is_file() else bundled


def load_patch_classifier(path: Path | None = None) -> PatchClassifier:
    """Return the classifier stored at ``path``, by default the bundled one.

    Raises WeightsError if it is missing, damaged or no classifier of this version.
    """
    from safetensors import SafetensorError
    from safetensors.torch import load

    path = patch_classifier_path() if path is None else path
    classifier, data = PatchClassifier(), read_file(path)
    metadata = read_metadata(data, path)
    check_format(metadata, CLASSIFIER_FORMAT, path)
    check_names(metadata, FEATURES, path)
    try:
        tensors = load(data)
        classifier.load_state_dict({name: tensor.float() for name, tensor in tensors.items()})
    except (SafetensorError, RuntimeError) as error:
        raise damaged(path) from error
    classifier.weights_hash = tensors_hash(data)
    return classifier.eval()


@lru_cache(maxsize=1)
def bundled_patch_classifier() -> PatchClassifier:
    """Return the bundled classifier, loaded once."""
    return load_patch_classifier()


def save_patch_classifier(
    classifier: PatchClassifier, path: Path, header: dict[str, object]
) -> None:
    """Write a classifier as float16, with ``header`` (plain JSON) beside it."""
    from safetensors.torch import save_file

    tensors = {k: v.to(torch.float16).contiguous() for k, v in classifier.state_dict().items()}
    about = json.dumps({**header, **FEATURES})
    save_file(tensors, path, {"format": CLASSIFIER_FORMAT, "header": about})
