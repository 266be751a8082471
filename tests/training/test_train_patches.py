# SPDX-License-Identifier: GPL-3.0-or-later
"""How the patch classifier is trained and measured."""

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("tqdm")

from liquid_splash_addon.core.condition.patches.features import PatchGraph  # noqa: E402
from liquid_splash_addon.core.generator.patch_classifier import load_patch_classifier  # noqa: E402
from training.data.items import load_items  # noqa: E402
from training.learning import train_patches  # noqa: E402
from training.learning.labelled_patches import LabelledPatches, label_all, label_patches  # noqa: E402
from training.learning.train_patches import figures_of, report, tell_apart, train  # noqa: E402


def chain(count: int, rng: np.random.Generator) -> LabelledPatches:
    """Return a strip of triangles, of which those beside one with a large first feature are wet.

    No triangle's own features say so: it takes a message from its neighbours.
    """
    points, triangles = (rng.normal(size=(n, k)) for n, k in ((count + 2, 14), (count, 32)))
    marked = rng.random(count) < 0.3
    triangles[:, 0] = 3.0 * marked
    beside = np.concatenate([marked[1:], [False]]) | np.concatenate([[False], marked[:-1]])
    numbers = np.arange(count)
    corners = numbers[:, None] + np.arange(3)
    graph = PatchGraph(
        points.astype(np.float32),
        triangles.astype(np.float32),
        corners,
        np.maximum(np.arange(count + 2) - 1, 0),
        np.minimum(np.arange(count + 2) + 1, count + 1),
        np.concatenate([numbers[1:], numbers[:-1]]),
        np.concatenate([numbers[:-1], numbers[1:]]),
        np.zeros((2 * count - 2, 4), dtype=np.float32),
    )
    wet = beside.astype(np.float32)
    return LabelledPatches(graph, wet, wet, np.ones(count, dtype=np.float32))


def test_scores_in_order_tell_all_apart_and_chance_none():
    inside, one = np.array([1.0, 1, 0, 0]), np.ones(4)
    assert tell_apart(np.array([4.0, 3, 2, 1]), inside, one) == {"auc": 1, "precision": 1}
    assert tell_apart(np.array([1.0, 2, 3, 4]), inside, one)["auc"] == 0
    # One of four pairs is the wrong way round; precisions 1 and 2/3 at both recalls.
    found = tell_apart(np.array([4.0, 2, 3, 1]), inside, one)
    assert found["auc"] == pytest.approx(0.75) and found["precision"] == pytest.approx(5 / 6)
    # The same by samples: the pair in the wrong order has nine times the weight of another.
    found = tell_apart(np.array([4.0, 2, 3, 1]), inside, np.array([1.0, 3, 3, 1]))
    assert found["auc"] == pytest.approx(1 - 9 / 16)
    rng = np.random.default_rng(0)
    chance = tell_apart(rng.random(4000), rng.random(4000), np.ones(4000))
    assert chance["auc"] == pytest.approx(0.5, abs=0.03)
    assert chance["precision"] == pytest.approx(0.5, abs=0.03)


def test_a_classifier_learns_what_only_neighbours_say():
    rng = np.random.default_rng(1)
    classifier = train([chain(60, rng) for _ in range(12)], 0, steps_in_all=300)
    unseen = [chain(60, rng) for _ in range(4)]
    figures = report(classifier, unseen)
    assert figures["judged"]["auc"] > 0.95
    own = figures_of(unseen, lambda sketch: sketch.graph.triangles[:, 0])
    assert own["auc"] < 0.7  # what the triangles say of themselves is not enough


@pytest.mark.parametrize("sketch", [None, 0])
def test_labels_say_which_patches_lie_in_liquid(toy_data: Path, sketch):
    item = load_items(toy_data, "train")[-1]
    labelled = label_patches(item, sketch)
    assert labelled is not None and len(labelled.graph.corners) == len(labelled.samples) > 10
    assert labelled.samples.min() >= 1
    assert (labelled.near >= labelled.inside).all() and (labelled.inside >= 0).all()
    assert 0.05 < np.average(labelled.inside, weights=labelled.samples) < 1
    assert labelled.near.max() <= 1
    same = label_patches(item, sketch)
    assert np.array_equal(same.inside, labelled.inside)


def test_the_command_trains_and_writes_a_classifier(toy_data: Path, run_command, tmp_path, capsys):
    out = tmp_path / "classifier.safetensors"
    arguments = (toy_data, "--out", out, "--minutes", 0.05, "--sketches", 1, "--workers", 1)
    assert run_command(train_patches.main, *arguments) == 0
    assert '"auc"' in capsys.readouterr().out
    sketches = label_all(load_items(toy_data, "validation"), [None], 1)
    assert (
        0
        < figures_of(sketches, lambda x: load_patch_classifier(out).classify(x.graph)[:, 0])["auc"]
        <= 1
    )
    assert run_command(train_patches.main, tmp_path / "nothing", "--out", out) == 1
    assert "python -m training simulate" in capsys.readouterr().err
