# SPDX-License-Identifier: GPL-3.0-or-later
"""The optimiser of our generator."""

import copy

import pytest

torch = pytest.importorskip("torch")

from liquid_splash_addon.core.generator.splash_unet import NetworkConfig, SplashNetwork  # noqa: E402
from training.learning.optimising import Muon, Optimiser, as_matrix, orthogonal, parameter_groups  # noqa: E402

SMALL = NetworkConfig((4, 8, 8, 8), (1, 1, 1, 1), (1, 1, 1), (4, 8), (1, 1, 1), latent_channels=2)


def network():
    """Return a small network, its kernels laid out as in training."""
    torch.manual_seed(0)
    return SplashNetwork(SMALL).to(memory_format=torch.channels_last_3d)


def give_gradients(module, seed):
    """Set every parameter's gradient to noise."""
    rng = torch.Generator().manual_seed(seed)
    for parameter in module.parameters():
        parameter.grad = torch.randn(parameter.shape, generator=rng)


def test_a_matrix_becomes_nearly_orthogonal_and_keeps_its_directions():
    torch.manual_seed(0)
    matrix = torch.randn(32, 216) * torch.logspace(0, -1.5, 32)[:, None]
    found = orthogonal(matrix)
    values = torch.linalg.svdvals(found)
    assert values.max() < 1.3 and values.min() > 0.6
    left, _, right = torch.linalg.svd(matrix, full_matrices=False)
    assert (
        torch.nn.functional.cosine_similarity(found.flatten(), (left @ right).flatten(), 0) > 0.97
    )


def test_orthogonal_is_torchs_own_iteration():
    muon = pytest.importorskip("torch.optim._muon")
    torch.manual_seed(1)
    matrix = torch.randn(16, 216)
    expected = muon._zeropower_via_newtonschulz(matrix, (3.4445, -4.775, 2.0315), 5, 1e-7)
    assert (orthogonal(matrix) - expected.float()).norm() < 0.03 * expected.float().norm()


def test_no_gradient_is_no_direction():
    assert not orthogonal(torch.zeros(4, 27)).any()


def test_every_parameter_is_optimised_once():
    module = network()
    groups = parameter_groups(module)
    names = [id(parameter) for group in groups for parameter in group]
    assert sorted(names) == sorted(id(parameter) for parameter in module.parameters())
    inside, weights, others = groups
    assert all(parameter.ndim == 5 for parameter in (*inside, *weights))
    assert all(parameter.ndim == 1 for parameter in others)
    heads = {module.coarse.head.weight, module.detail.head.weight, module.coarse.stem.weight}
    assert heads <= set(weights), "zero at first, or few inputs: not for Muon"


def test_a_step_has_the_size_of_adams_and_the_gradients_are_dropped():
    module = network()
    before = copy.deepcopy(module)
    give_gradients(module, 0)
    Optimiser(module, learning_rate=1e-2, weight_decay=0.0).step(rate=0.5)
    for old, new in zip(before.parameters(), module.parameters(), strict=True):
        moved = (new - old).detach().square().mean().sqrt()
        assert 0.1 * 5e-3 < moved < 2 * 5e-3
        assert new.grad is None


def test_it_minimises_where_directions_differ_in_scale():
    torch.manual_seed(0)
    kernel = torch.nn.Parameter(torch.zeros(8, 4, 1, 1, 1))
    target, inputs = torch.randn(8, 4), torch.randn(64, 4) * torch.tensor([1.0, 0.3, 0.1, 0.03])
    muon = Muon([kernel], lr=0.3, weight_decay=0.0)
    losses = []
    for step in range(300):
        muon.param_groups[0]["lr"] = 0.3 * (1 - step / 300)
        error = inputs @ (kernel[..., 0, 0, 0] - target).T
        loss = error.square().mean()
        losses.append(float(loss.detach()))
        muon.zero_grad()
        loss.backward()
        muon.step()
    assert losses[-1] < 1e-3 * losses[0]
    # The weakest direction too, which gradient descent would leave for last.
    assert (as_matrix(kernel)[:, 3] - target[:, 3]).abs().max() < 0.1


def test_it_goes_on_from_its_state_exactly():
    module, rate = network(), 1.0
    optimiser = Optimiser(module, 1e-2, 1e-2)
    give_gradients(module, 1)
    optimiser.step(rate)
    other = copy.deepcopy(module)
    again = Optimiser(other, 1e-2, 1e-2)
    again.load_state_dict(copy.deepcopy(optimiser.state_dict()))
    for net, opt in ((module, optimiser), (other, again)):
        give_gradients(net, 2)
        opt.step(rate)
    for one, two in zip(module.parameters(), other.parameters(), strict=True):
        assert torch.equal(one, two)
