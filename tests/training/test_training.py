# SPDX-License-Identifier: GPL-3.0-or-later
"""Training, evaluation and export at toy size."""

import json
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from liquid_splash_addon.core.network import NetworkConfig  # noqa: E402
from liquid_splash_addon.core.settings import SplashSettings  # noqa: E402
from liquid_splash_addon.core.weights import load_generator  # noqa: E402
from training import evaluate, export  # noqa: E402
from training.baselines import best_radius, stroke_distance  # noqa: E402
from training.dataset import load_items, training_samples  # noqa: E402
from training.losses import Batch, sample_losses  # noqa: E402
from training.metrics import occupancy_metrics, velocity_metrics  # noqa: E402
from training.train import Run, TrainConfig, collate, random_latents, train  # noqa: E402

SHAPE = NetworkConfig((4, 8, 8, 8), (1, 1, 1, 1), (1, 1, 1), latent_channels=2)
CONFIG = TrainConfig(minutes=10, batch=2, cells=32, warmup=1, imle_from=0.0, candidates=2)


@pytest.fixture
def batches(toy_data: Path):
    """Return three batches of real samples."""
    samples = training_samples(load_items(toy_data, "train"), 0, 32)
    return [collate([next(samples) for _ in range(2)]) for _ in range(3)]


def toy_run(out: Path, **changes) -> Run:
    """Return a fresh run of a small network."""
    return Run(TrainConfig(**{**CONFIG.__dict__, **changes}), SHAPE, out)


def test_perfect_output_has_the_least_loss():
    distance = torch.full((1, 16, 16, 16), 3.0)
    distance[:, 4:8] = -2.0
    velocity = torch.zeros(1, 3, 16, 16, 16)
    velocity[:, 0, 3:9] = 0.4
    batch = Batch(torch.zeros(1, 4, 16, 16, 16), torch.zeros(1), distance, velocity)
    logit = torch.where(distance < 0, 20.0, -20.0)
    perfect = torch.cat([logit[:, None], distance[:, None] / 3, velocity], 1)
    assert sample_losses(perfect, batch)[0] < 1e-3
    for channel in range(5):
        worse = perfect.clone()
        worse[:, channel] += 1.0 if channel else -22.0
        assert sample_losses(worse, batch)[0] > 0.01


def test_training_lowers_the_loss(tmp_path: Path, batches):
    run = toy_run(tmp_path, deterministic=1.0)
    losses = [run.step(batches[0]) for _ in range(25)]
    assert losses[-1] < 0.9 * losses[0]


def test_a_stopped_run_goes_on_exactly(tmp_path: Path, batches):
    straight = toy_run(tmp_path / "straight")
    expected = [straight.step(batch) for batch in batches]
    (tmp_path / "halting").mkdir()
    halting = toy_run(tmp_path / "halting")
    first = halting.step(batches[0])
    halting.save()
    again = toy_run(tmp_path / "halting")
    again.load()
    assert [first, *(again.step(batch) for batch in batches[1:])] == pytest.approx(
        expected, rel=1e-5
    )
    assert again.steps == 3


def test_best_of_several_latents_is_trained(tmp_path: Path, batches):
    from training.train import best_latents

    run = toy_run(tmp_path)
    run.network.eval()  # in training, batch norm mixes the samples of a batch
    encoding = run.network.encode(batches[0].condition, batches[0].scale)
    tries = [random_latents(SHAPE, batches[0], run.random) * 30 for _ in range(4)]
    best = best_latents(run.network, encoding, batches[0], tries)
    with torch.no_grad():
        losses = torch.stack(
            [sample_losses(run.network.decode(encoding, z), batches[0]) for z in tries]
        )
        chosen = sample_losses(run.network.decode(encoding, best), batches[0])
    assert torch.allclose(chosen, losses.min(0).values, atol=1e-4)


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
    condition = np.zeros((4, 24, 24, 24), np.float32)
    condition[0, 4:20, 12, 12] = 1
    distance = stroke_distance(condition)
    assert best_radius([distance], [distance <= 3.0]) == pytest.approx(3.0, abs=0.25)


def test_the_whole_chain(toy_data: Path, tmp_path: Path, run_command):
    """Train for a moment, export, evaluate: each command does its part with real data."""
    out = tmp_path / "run"
    out.mkdir()
    run = toy_run(out, minutes=0.05)
    train(run, load_items(toy_data, "train"), workers=0)
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
    assert set(found) == {"ours", "dilated_strokes", "nearest"}
    for row in found.values():
        assert 0 <= row["iou"] <= 1
    assert found["dilated_strokes"]["iou"] > 0


def test_export_without_a_run_says_what_to_do(toy_data: Path, tmp_path: Path, run_command, capsys):
    assert run_command(export.main, tmp_path / "none", "--data", toy_data) == 1
    assert "training.train" in capsys.readouterr().err


def test_published_figures_are_those_of_the_bundled_weights_and_beat_both_baselines():
    root = Path(__file__).resolve().parents[2]
    published = json.loads((root / "docs" / "results" / "accuracy.json").read_text())
    generator = load_generator(device="CPU")
    assert published["about"]["weights_hash"] == generator.weights_hash
    assert generator.header["figures"]["128"] == published["128"]
    for cells in ("64", "128"):
        rows = published[cells]
        assert rows["ours"]["iou"] > max(rows["dilated_strokes"]["iou"], rows["nearest"]["iou"])


def test_default_size_is_the_median_of_training():
    assert SplashSettings().real_size == pytest.approx(
        load_generator(device="CPU").header["real_size"], rel=0.1
    )
