# SPDX-License-Identifier: GPL-3.0-or-later
"""Training, evaluation and export at toy size."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from torch.utils.data._utils.pin_memory import pin_memory  # noqa: E402

from liquid_splash_addon.core.condition.channels import (  # noqa: E402
    CHANNELS,
    PATCH_VELOCITY,
    STROKE_VELOCITY,
)
from liquid_splash_addon.core.generator.latent import candidates, latent_shape  # noqa: E402
from liquid_splash_addon.core.generator.loading import load_generator  # noqa: E402
from liquid_splash_addon.core.generator.patch_classifier import load_patch_classifier  # noqa: E402
from liquid_splash_addon.core.generator.splash_unet import NetworkConfig, SplashNetwork  # noqa: E402
from liquid_splash_addon.core.settings import SplashSettings  # noqa: E402
from tests.core.batches import sparse_condition  # noqa: E402
from training.data.batch import VELOCITY_SCALE, Cells  # noqa: E402
from training.data.items import load_items  # noqa: E402
from training.data.stream import (  # noqa: E402
    SampleSpecification,
    TrainingSamples,
    collate,
    stream,
)
from training.evaluation import evaluate  # noqa: E402
from training.evaluation.answers import BASELINES  # noqa: E402
from training.evaluation.baselines import best_radius, distance_to  # noqa: E402
from training.learning import (  # noqa: E402
    export,
    parallel,
)
from training.learning import train as train_module  # noqa: E402
from training.learning.losses import sample_losses  # noqa: E402
from training.learning.splash_learner import SplashConfig, SplashLearner, crop_each  # noqa: E402
from training.learning.train import Run, TrainConfig, train  # noqa: E402
from training.measures.metrics import occupancy_metrics, velocity_metrics  # noqa: E402

SHAPE = NetworkConfig((4, 8, 8, 8), (1, 1, 1, 1), (1, 1, 1), (4, 8), (1, 1, 1), latent_channels=2)
CONFIG = TrainConfig(minutes=10, batch=2, cells=32, crop=32, warmup=1)
IMLE = SplashConfig(imle_from=0.0, candidates=2)


@pytest.fixture
def batches(toy_data: Path):
    """Return three batches of real samples."""
    samples = TrainingSamples(load_items(toy_data, "train"), SampleSpecification(32, 32), 0)
    endless = stream(samples, 2, workers=0)
    return [next(endless) for _ in range(3)]


def toy_learner(**changes) -> SplashLearner:
    """Return a small network's learner that has learned nothing yet."""
    return SplashLearner(replace(IMLE, **changes), SHAPE, cells=32)


def toy_run(out: Path, **changes) -> Run:
    """Return a fresh run of a small network."""
    out.mkdir(exist_ok=True)
    return Run(replace(CONFIG, **changes), toy_learner(), out, {"kind": "splash"})


def test_perfect_output_has_the_least_loss():
    distance = torch.full((1, 16, 16, 16), 3.0)
    distance[:, 4:8] = -2.0
    velocity = torch.zeros(1, 3, 16, 16, 16)
    velocity[:, 0, 3:9] = 0.4
    nothing = sparse_condition(torch.zeros(1, CHANNELS, 16, 16, 16))
    cells = Cells(nothing, distance, velocity)
    logit = torch.where(distance < 0, 20.0, -20.0)
    perfect = torch.cat([logit[:, None], distance[:, None] / 3, velocity], 1)
    assert sample_losses(perfect, cells)[0] < 1e-3
    for channel in range(5):
        worse = perfect.clone()
        worse[:, channel] += 1.0 if channel else -22.0
        assert sample_losses(worse, cells)[0] > 0.01


def test_training_lowers_the_loss_of_both_networks(batches):
    learner = toy_learner(deterministic=1.0)
    losses = [learner.step(batches[0], 0.0, 1.0) for _ in range(25)]
    assert losses[-1]["draft"] < 0.9 * losses[0]["draft"]
    assert losses[-1]["detail"] < 0.9 * losses[0]["detail"]


def densely(samples) -> torch.Tensor:
    """Return the conditions of samples, ``(B, 18, X, Y, Z)``, velocities over their scale."""
    dense = torch.from_numpy(np.stack([sample.condition.dense() for sample in samples]))
    for which in (STROKE_VELOCITY, PATCH_VELOCITY):
        dense[:, which] /= VELOCITY_SCALE
    return dense


def test_sparse_batches_teach_what_dense_conditions_would(toy_data: Path):
    samples = TrainingSamples(load_items(toy_data, "train"), SampleSpecification(32, 32), 0)
    drawn = [samples[number] for number in range(2)]
    batch = collate(drawn)
    boxes, parts = (densely(lot) for lot in zip(*((s.box, s.part) for s in drawn), strict=True))
    for cells, dense in ((batch.box, boxes), (batch.detail, parts)):
        assert torch.equal(cells.condition.dense(), dense)
        assert torch.equal(cells.condition.stroke_occupancy(), dense[:, 0])
    searched = replace(
        batch,
        box=replace(batch.box, condition=sparse_condition(boxes)),
        detail=replace(batch.detail, condition=sparse_condition(parts)),
    )
    learners = [toy_learner(deterministic=1.0) for _ in range(2)]
    for _ in range(2):
        losses = [
            learner.step(given, 0.0, 1.0)
            for learner, given in zip(learners, (batch, searched), strict=True)
        ]
        assert losses[0] == pytest.approx(losses[1], abs=1e-6)
    weights = [learner.network.state_dict() for learner in learners]
    for name, tensor in weights[0].items():
        assert torch.allclose(weights[1][name], tensor, atol=1e-6), name


def test_all_of_a_batch_is_pinned_and_moved(batches, monkeypatch):
    pinned = []
    monkeypatch.setattr(torch.Tensor, "pin_memory", lambda x: pinned.append(x) or x.clone())
    batch = pin_memory(batches[0])  # as torch's loader does
    assert len(pinned) == 9
    for given, cells in ((batches[0].box, batch.box), (batches[0].detail, batch.detail)):
        assert torch.equal(cells.condition.dense(), given.condition.dense())
        assert tuple(cells.condition.shape) == given.condition.shape
    moved = batch.to("meta")
    for cells in (moved.box, moved.detail):
        tensors = (*cells.condition[:2], cells.distance, cells.velocity)
        assert all(tensor.is_meta for tensor in tensors)
    assert moved.obstacle.is_meta and not moved.start.is_meta


def test_a_stopped_run_goes_on_exactly(toy_data: Path, tmp_path: Path):
    """Also in what it is shown: a killed run repeats nothing and leaves nothing out."""
    items = load_items(toy_data, "train")
    straight = toy_run(tmp_path / "straight", steps=4)
    train(straight, items, items[:1], workers=0)
    halting = toy_run(tmp_path / "halting", steps=4)
    endless = stream(TrainingSamples(items, SampleSpecification(32, 32), 0), 2, workers=0)
    for _ in range(2):
        halting.learner.step(next(endless), halting.progress, halting.rate)
        halting.steps += 1
    halting.save()
    again = toy_run(tmp_path / "halting", steps=4)
    again.load()
    assert again.steps == 2
    train(again, items, items[:1], workers=1)
    state, expected = again.learner.state(), straight.learner.state()
    for name, tensor in expected["network"].items():
        assert torch.allclose(state["network"][name], tensor, atol=1e-6), name
    for name, tensor in expected["average"].items():
        assert torch.allclose(state["average"][name], tensor, atol=1e-6), name


def test_scenes_that_appear_meanwhile_are_taken_up(toy_data: Path, tmp_path: Path, monkeypatch):
    items = load_items(toy_data, "train")
    run = toy_run(tmp_path / "run", steps=3, checkpoint=0.0)
    used = []

    def noted(given, *rest):
        used.append(len(given))
        return TrainingSamples(given, *rest)

    monkeypatch.setattr(train_module, "TrainingSamples", noted)
    train(run, items[:1], items[:1], workers=0, reload=lambda: items)
    assert used == [1, len(items)] and len(items) > 1 and run.steps == 3


def test_a_run_of_another_model_is_not_gone_on_with(tmp_path: Path):
    toy_run(tmp_path / "run").save()
    other = Run(CONFIG, toy_learner(), tmp_path / "run", {"kind": "paper"})
    with pytest.raises(ValueError, match="another --out"):
        other.load()


@pytest.mark.parametrize("change", [{"cells": 64}, {"seed": 3}, {"batch": 4}, {"obstacle": 0.1}])
def test_a_run_is_not_gone_on_with_under_other_settings(tmp_path: Path, change):
    toy_run(tmp_path / "run").save()
    with pytest.raises(ValueError, match=f"--{next(iter(change))}"):
        toy_run(tmp_path / "run", **change).load()
    toy_run(tmp_path / "run", minutes=20, checkpoint=1).load()


def test_each_process_takes_a_gpu_of_its_own(monkeypatch):
    taken = []
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 4)
    monkeypatch.setattr(torch.cuda, "set_device", taken.append)
    monkeypatch.setattr(parallel.dist, "init_process_group", lambda backend: None)
    monkeypatch.setattr(parallel.dist, "get_rank", lambda: 6)
    monkeypatch.setattr(parallel.dist, "get_world_size", lambda: 8)
    monkeypatch.setenv("RANK", "6")
    monkeypatch.setenv("LOCAL_RANK", "2")
    assert parallel.start() == (6, 8) and taken == [2]


def test_best_of_several_latents_is_trained(batches):
    learner, batch = toy_learner(candidates=4, deterministic=0.0), batches[0]
    for modulation in learner.network.coarse.modulations:
        modulation.shift.weight.data.mul_(30)
    encoding = learner.network.coarse.encode(batch.box.condition, batch.obstacle)
    before = learner.random.get_state()
    best = learner.choose_latent(encoding, batch, 1.0)
    learner.random.set_state(before)
    torch.rand((), generator=learner.random)
    rng = np.random.default_rng(int(torch.randint(2**62, (), generator=learner.random)))
    each = [candidates(SHAPE, 4, rng) for _ in range(len(best))]
    tries = [torch.from_numpy(np.stack(lot)) for lot in zip(*each, strict=True)]

    def losses(z):
        with torch.no_grad():
            return sample_losses(learner.network.coarse.decode(encoding, z).output, batch.box)

    assert torch.allclose(losses(best), torch.stack([losses(z) for z in tries]).min(0).values)
    assert learner.choose_latent(encoding, batch, -1.0) is None


def test_parts_are_cut_where_they_begin():
    x = torch.arange(2 * 1 * 6 * 6 * 6.0).reshape(2, 1, 6, 6, 6)
    parts = crop_each(x, torch.tensor([[0, 1, 2], [3, 2, 1]]), 3)
    assert torch.equal(parts[0], x[0, :, 0:3, 1:4, 2:5])
    assert torch.equal(parts[1], x[1, :, 3:6, 2:5, 1:4])


def test_metrics_of_known_shapes():
    truth = np.zeros((20, 20, 20), bool)
    truth[5:15, 5:15, 5:15] = True
    shifted = np.roll(truth, 2, axis=0)
    found = occupancy_metrics(shifted, truth, spacing=0.005)
    assert found["iou"] == pytest.approx(800 / 1200)
    assert found["tpr"] == found["precision"] == pytest.approx(0.8)
    assert found["fpr"] == pytest.approx(200 / 7000)
    assert found["hausdorff_cells"] == pytest.approx(2.0)
    assert found["hausdorff_mm"] == pytest.approx(10.0)
    same = occupancy_metrics(truth, truth, 0.005)
    assert same["iou"] == same["f_score"] == 1 and same["hd95_cells"] == 0
    empty = occupancy_metrics(np.zeros_like(truth), truth, 0.005)
    assert empty["iou"] == 0 and np.isnan(empty["hausdorff_mm"])


def test_velocity_metrics_of_a_turned_flow():
    occupied = np.ones((4, 4, 4), bool)
    truth = np.zeros((3, 4, 4, 4))
    truth[0] = 2.0
    turned = np.zeros_like(truth)
    turned[1] = 2.0
    found = velocity_metrics(turned, truth, occupied)
    assert found["angle_deg"] == pytest.approx(90)
    assert found["velocity_error"] == pytest.approx(np.sqrt(2))


def test_the_radius_of_a_thick_line_is_found():
    drawn = np.zeros((24, 24, 24), bool)
    drawn[4:20, 12, 12] = True
    distance = distance_to(drawn)
    assert best_radius([distance], [distance <= 3.0]) == pytest.approx(3.0, abs=0.25)


def test_the_whole_chain(toy_data: Path, tmp_path: Path, run_command):
    """Train for a moment, export, evaluate: each command does its part with real data."""
    out = tmp_path / "run"
    run = toy_run(out, minutes=0.05)
    train(run, load_items(toy_data, "train"), load_items(toy_data, "validation"), workers=0)
    look = json.loads((out / "curve.jsonl").read_text().splitlines()[-1])
    assert (
        look["samples"] == 2 * run.steps and 0 <= look["iou_32"] <= 1 and 0 <= look["iou_64"] <= 1
    )
    assert run.steps > 0 and run.progress == 1
    weights = tmp_path / "w.safetensors"
    assert run_command(export.main, out, "--data", toy_data, "--out", weights, "--most", 1) == 0
    header = load_generator(weights, "CPU").header
    assert header["steps"] == run.steps and 0 < header["real_size"] < 0.5
    figures = tmp_path / "accuracy.json"
    arguments = (toy_data, "--weights", weights, "--out", figures, "--most", 2, "--grids", 32)
    assert run_command(evaluate.main, *arguments) == 0
    written = json.loads(figures.read_text())
    assert written["about"]["weights_hash"] == load_generator(weights, "CPU").weights_hash
    found = written["32"]
    assert set(found) == {"ours", "dilated_strokes", "dilated_spans", "nearest"}
    for row in found.values():
        assert 0 <= row["iou"] <= 1
    assert found["dilated_strokes"]["iou"] > 0


def test_the_mean_of_two_networks_is_half_way():
    one, other = (SplashNetwork(SHAPE) for _ in range(2))
    expected = [
        (a + b).detach() / 2 for a, b in zip(one.parameters(), other.parameters(), strict=True)
    ]
    export.average_with(one, other)
    for mean, wanted in zip(one.parameters(), expected, strict=True):
        assert torch.allclose(mean, wanted, atol=1e-6)
    with pytest.raises(ValueError, match="another shape"):
        export.average_with(one, SplashNetwork(NetworkConfig()))


def test_scaled_latents_do_what_smaller_ones_did():
    network = SplashNetwork(SHAPE).eval()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(0.1 * torch.randn(parameter.shape))
    condition = torch.zeros(1, CHANNELS, 32, 32, 32)
    condition[:, :4, 8:20, 16, 16] = 1
    crossed = sparse_condition(condition)
    latent = torch.randn(1, *latent_shape(SHAPE))
    with torch.no_grad():
        plain, expected = (network.draft(crossed, z).output for z in (None, 0.5 * latent))
        export.scale_latents(network, 0.5)
        assert torch.allclose(network.draft(crossed, latent).output, expected, atol=1e-5)
        assert torch.equal(network.draft(crossed).output, plain)
    assert not torch.allclose(plain, expected, atol=1e-3)


def test_export_without_a_run_says_what_to_do(toy_data: Path, tmp_path: Path, run_command, capsys):
    assert run_command(export.main, tmp_path / "none", "--data", toy_data) == 1
    assert "python -m training train" in capsys.readouterr().err


def test_published_figures_are_those_of_the_bundled_weights_and_beat_the_baselines():
    root = Path(__file__).resolve().parents[2]
    published = json.loads((root / "docs" / "results" / "accuracy.json").read_text())
    generator = load_generator(device="CPU")
    assert published["about"]["weights_hash"] == generator.weights_hash
    assert generator.header["figures"]["128"] == published["128"]
    for cells in ("64", "128"):
        rows = published[cells]
        assert rows["ours"]["iou"] > max(rows[name]["iou"] for name in BASELINES)


def test_the_bundled_generator_was_shown_what_the_bundled_classifier_says():
    generator = load_generator(device="CPU")
    assert generator.classifier.weights_hash == load_patch_classifier().weights_hash
    assert generator.header["patch_classifier_hash"] == generator.classifier.weights_hash


def test_default_size_is_the_median_of_training():
    assert SplashSettings().real_size == pytest.approx(
        load_generator(device="CPU").header["real_size"], rel=0.1
    )
