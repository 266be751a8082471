# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's networks and their training at toy size."""

import itertools
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from torch.utils.flop_counter import FlopCounterMode  # noqa: E402

from liquid_splash_addon.core.condition.channels import CHANNELS  # noqa: E402
from liquid_splash_addon.core.grid import Grid  # noqa: E402
from tests.core.batches import sparse_condition  # noqa: E402
from tests.core.sketching import sparse  # noqa: E402
from training.data.batch import VELOCITY_SCALE, Batch, Cells  # noqa: E402
from training.learning.paper import paper_learner  # noqa: E402
from training.learning.paper.networks import (  # noqa: E402
    PaperConfig,
    PaperDiscriminator,
    PaperGenerator,
    answer,
    load_paper,
)
from training.learning.paper.paper_learner import PaperLearner, target  # noqa: E402
from training.measures.metrics import iou  # noqa: E402

CELLS = 16
GAN = PaperConfig(CELLS, width=4, learning_rate=2e-3)
PLAIN = PaperConfig(CELLS, width=16, adversarial=False, learning_rate=3e-3)


def toy_batch(size: int = 1, cells: int = CELLS) -> Batch:
    """Return bent sheets that rise, the stroke in the middle of each, and noise in the air."""
    x, y, z = torch.meshgrid(*[torch.arange(cells) + 0.5] * 3, indexing="ij")
    middle = cells * torch.linspace(0.4, 0.6, size + 2)[1:-1, None, None, None]
    height = middle + cells / 8 * torch.sin(x * 3 / cells)
    distance = ((z - height).abs() - cells / 10).clamp(-3, 3)
    velocity = torch.rand((size, 3, cells, cells, cells), generator=torch.Generator())
    velocity = torch.where(
        distance[:, None] < 0, torch.tensor([0.2, 0, 0.6])[:, None, None, None], velocity
    )
    crossed = ((z - height).abs() < 1) & ((y - cells / 2).abs() < 1)
    condition = torch.zeros(size, CHANNELS, cells, cells, cells)
    condition[:, 0], condition[:, 1:4] = crossed, velocity * crossed[:, None]
    box = Cells(sparse_condition(condition), distance, velocity)
    return Batch(box, torch.zeros_like(condition[:, :1]))


def weights(network: torch.nn.Module) -> torch.Tensor:
    """Return a copy of all parameters in one row."""
    return torch.cat([p.detach().flatten() for p in network.parameters()])


def count(network: torch.nn.Module) -> int:
    """Return the number of parameters."""
    return sum(p.numel() for p in network.parameters())


def operations(network: torch.nn.Module, *inputs: torch.Tensor) -> int:
    """Return the operations of one pass, two for each multiplication with an addition."""
    with FlopCounterMode(display=False) as counter:
        network(*inputs)
    return counter.get_total_flops()


def test_full_networks_have_the_size_that_the_papers_figures_imply():
    with torch.device("meta"):
        generator, opponent = PaperGenerator(PaperConfig()), PaperDiscriminator(PaperConfig())
        grid = torch.empty(1, 4, 128, 128, 128)
        output = generator(grid)
        assert output.shape == grid.shape
        assert count(generator) == pytest.approx(167.3e6, rel=1e-3)
        assert operations(generator, grid) == pytest.approx(213.5e9, rel=1e-3)
        assert operations(opponent, grid, output) == pytest.approx(77.3e9, rel=1e-3)


@pytest.mark.parametrize(("cells", "levels"), [(16, 4), (64, 6), (128, 7)])
def test_levels_end_in_one_cell(cells: int, levels: int):
    config = PaperConfig(cells, width=1)
    assert len(config.widths) == levels
    with torch.device("meta"):
        generator, opponent = PaperGenerator(config), PaperDiscriminator(config)
        grid = torch.empty(2, 4, cells, cells, cells)
        found = []
        generator.encoder[-1].register_forward_hook(lambda *seen: found.append(seen[2].shape))
        assert generator(grid).shape == grid.shape
        assert found[0][2:] == (1, 1, 1)
        assert opponent(grid, grid).shape == (2,)


def test_sizes_that_do_not_halve_to_one_cell_are_refused():
    for cells in (8, 96):
        with pytest.raises(ValueError, match="power of two"):
            PaperConfig(cells)


def test_target_has_no_velocity_in_the_air():
    batch = toy_batch()
    wanted = target(batch)
    liquid = (batch.box.distance < 0).expand(3, -1, -1, -1)
    assert set(wanted[0, 0].unique().tolist()) == {0.0, 1.0}
    assert torch.equal(wanted[0, 1:][liquid], batch.box.velocity[0][liquid])
    assert batch.box.velocity[0][~liquid].abs().max() > 0
    assert wanted[0, 1:][~liquid].abs().max() == 0


def test_plain_network_learns_one_pair_by_heart():
    batch = toy_batch()
    learner = PaperLearner(PLAIN)
    first = learner.step(batch, 0, 1)
    for _ in range(150):
        last = learner.step(batch, 0, 1)
    learner.finish(itertools.repeat(batch))
    output = learner.predict(batch)
    truth = batch.box.distance[0] < 0
    assert iou((output[0, 0] > 0.5).numpy(), truth.numpy()) > 0.9
    assert (output[0, 3][truth] - 0.6).abs().mean() < 0.3  # nothing learnt: 0.6
    assert last["l1"] < 0.3 * first["l1"]


def test_plain_network_has_no_discriminator():
    learner = PaperLearner(PLAIN)
    losses = learner.step(toy_batch(), 0, 1)
    assert set(losses) == {"loss", "l1"}
    assert losses["loss"] == pytest.approx(100 * losses["l1"])
    assert learner.discriminator is None and "discriminator" not in learner.state()


def test_a_step_trains_both_networks():
    learner = PaperLearner(GAN)
    both = (learner.generator, learner.discriminator)
    before = [weights(network) for network in both]
    losses = learner.step(toy_batch(2), 0, 1)
    assert set(losses) == {"loss", "l1", "adversarial", "discriminator"}
    assert all(np.isfinite(value) and value > 0 for value in losses.values())
    assert losses["loss"] == pytest.approx(100 * losses["l1"] + losses["adversarial"])
    for network, old in zip(both, before, strict=True):
        assert not torch.equal(weights(network), old)


def test_each_network_is_trained_for_its_own_end():
    learner = PaperLearner(GAN)
    batch = toy_batch(2)
    truth, output = target(batch), learner.generator(learner.condition(batch))
    opinion = weights(learner.discriminator)
    learner.improve(learner.condition(batch), truth, output, 1)
    assert torch.equal(weights(learner.discriminator), opinion)
    made = weights(learner.generator)
    learner.oppose(learner.condition(batch), truth, output.detach(), 1)
    assert torch.equal(weights(learner.generator), made)


def test_discriminator_learns_to_tell_truth_from_output():
    learner = PaperLearner(GAN)
    batch = toy_batch(2)
    truth, output = target(batch), learner.generator(learner.condition(batch)).detach()
    for _ in range(20):
        loss = learner.oppose(learner.condition(batch), truth, output, 1)
    assert loss < 0.2
    assert (learner.discriminator(learner.condition(batch), truth) > 0).all()
    assert (learner.discriminator(learner.condition(batch), output) < 0).all()


def test_generator_learns_to_pass_for_the_truth():
    learner = PaperLearner(PaperConfig(CELLS, width=4, l1_weight=0.0, learning_rate=2e-3))
    batch = toy_batch(2)
    truth = target(batch)
    for _ in range(20):
        learner.oppose(
            learner.condition(batch), truth, learner.generator(learner.condition(batch)).detach(), 1
        )
    losses = []
    for _ in range(20):
        output = learner.generator(learner.condition(batch))
        losses.append(learner.improve(learner.condition(batch), truth, output, 1)["adversarial"])
    assert losses[-1] < 0.5 * losses[0]


def test_rate_scales_the_steps():
    sizes = []
    for rate in (1.0, 0.1):
        learner = PaperLearner(PLAIN)
        before = weights(learner.generator)
        learner.step(toy_batch(), 0, rate)
        sizes.append(float((weights(learner.generator) - before).abs().max()))
    assert sizes[0] == pytest.approx(10 * sizes[1], rel=1e-2)


def test_every_gradient_is_averaged_over_the_processes(monkeypatch: pytest.MonkeyPatch):
    def cancel(parameters):
        for parameter in parameters:
            parameter.grad.zero_()

    learner = PaperLearner(GAN)
    before = [weights(learner.generator), weights(learner.discriminator)]
    monkeypatch.setattr(paper_learner, "average_gradients", cancel)
    learner.step(toy_batch(2), 0, 1)
    assert torch.equal(weights(learner.generator), before[0])
    assert torch.equal(weights(learner.discriminator), before[1])


@pytest.mark.parametrize("config", [GAN, PLAIN])
def test_a_stopped_run_goes_on_exactly(tmp_path: Path, config: PaperConfig):
    batches = [toy_batch(2), toy_batch(3), toy_batch(2), toy_batch(1)]
    straight = PaperLearner(config)
    for batch in batches[:2]:
        straight.step(batch, 0, 1)
    torch.save(straight.state(), tmp_path / "state.pt")
    expected = [straight.step(batch, 0, 1) for batch in batches[2:]]
    again = PaperLearner(config, seed=1)
    again.restore(torch.load(tmp_path / "state.pt", weights_only=True))
    for batch, losses in zip(batches[2:], expected, strict=True):
        assert again.step(batch, 0, 1) == pytest.approx(losses, rel=1e-6)


def test_answers_repeat_and_leave_random_numbers_alone():
    learner = PaperLearner(GAN)
    batch = toy_batch(2)
    learner.step(batch, 0, 1)
    random, running = torch.get_rng_state(), learner.generator.encoder[1][1].running_mean.clone()
    first = learner.predict(batch)
    assert torch.equal(torch.get_rng_state(), random)
    assert torch.equal(learner.generator.encoder[1][1].running_mean, running)
    torch.rand(5)
    assert torch.equal(learner.predict(batch), first)
    assert not first.requires_grad and first.shape == learner.condition(batch).shape
    assert 0 <= first[:, 0].min() and first[:, 0].max() <= 1


def test_dropout_is_the_noise_in_use():
    learner = PaperLearner(GAN)
    condition = learner.condition(toy_batch())
    one, other = (answer(learner.generator, condition, seed) for seed in (0, 1))
    assert not torch.allclose(one, other, atol=1e-5)
    quiet = PaperGenerator(PaperConfig(CELLS, width=4, dropout=0.0))
    assert torch.equal(answer(quiet, condition, 0), answer(quiet, condition, 1))


def test_finish_takes_the_statistics_of_the_batches_given():
    learner = PaperLearner(PLAIN)
    batch = toy_batch(2)
    learner.step(batch, 0, 1)
    learner.finish(itertools.repeat(batch))
    level = learner.generator.encoder[:2]
    with torch.no_grad():
        seen = level[1][0](torch.nn.functional.leaky_relu(level[0](learner.condition(batch)), 0.2))
    assert torch.allclose(level[1][1].running_mean, seen.mean((0, 2, 3, 4)), atol=1e-5)
    assert level[1][1].momentum == paper_learner.NORM_MOMENTUM


def test_half_precision_trains_float32_weights():
    learner = PaperLearner(GAN, precision=torch.bfloat16)
    exact = PaperLearner(GAN)
    batch = toy_batch(2)
    formats = set()
    for network in (learner.generator.encoder[1][0], learner.discriminator.layers[1][0]):
        network.register_forward_hook(lambda *seen: formats.add(seen[2].dtype))
    half, whole = learner.step(batch, 0, 1), exact.step(batch, 0, 1)
    assert formats == {torch.bfloat16}
    assert half["l1"] == pytest.approx(whole["l1"], rel=0.02)
    assert weights(learner.generator).dtype == torch.float32
    assert learner.predict(batch).dtype == torch.float32


def test_a_run_is_loaded_for_use(tmp_path: Path):
    learner = PaperLearner(GAN)
    batch = toy_batch()
    learner.step(toy_batch(2), 0, 1)
    state = {"kind": "paper", "config": asdict(GAN), "learner": learner.state(), "steps": 1}
    torch.save(state, tmp_path / "checkpoint.pt")
    condition = learner.condition(batch)[0].numpy().copy()
    condition[1:] *= VELOCITY_SCALE
    given, grid = condition.copy(), Grid.local(CELLS)
    loaded = load_paper(tmp_path)
    fields = loaded.generate(sparse(condition), grid)
    expected = learner.predict(batch)[0].numpy()
    assert np.array_equal(condition, given)
    np.testing.assert_allclose(fields.occupancy, expected[0], atol=1e-5)
    np.testing.assert_allclose(fields.velocity, VELOCITY_SCALE * expected[1:], atol=1e-4)
    np.testing.assert_allclose(fields.phi, fields.occupancy, atol=1e-6)
    assert fields.grid == grid and fields.distance.dtype == np.float32
    other = loaded.generate(sparse(condition), grid, latent=np.ones(3, np.float32))
    assert not np.allclose(other.occupancy, fields.occupancy, atol=1e-5)
    loaded.threshold = 0.3
    shifted = loaded.generate(sparse(condition), grid)
    assert np.array_equal(shifted.occupancy > 0.5, fields.occupancy > 0.3)
    np.testing.assert_allclose(shifted.phi, shifted.occupancy, atol=1e-6)
    with pytest.raises(ValueError, match=f"trained on {CELLS}"):
        loaded.generate(sparse(np.zeros((4, 32, 32, 32), np.float32)), Grid.local(32))


def test_another_models_run_is_refused(tmp_path: Path):
    torch.save({"kind": "splash"}, tmp_path / "checkpoint.pt")
    with pytest.raises(ValueError, match="no run of the paper's model"):
        load_paper(tmp_path)
