# SPDX-License-Identifier: GPL-3.0-or-later
"""The network and its weights file."""

import json

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from liquid_splash_addon.core.generator import Generator, draw_latent, settle  # noqa: E402
from liquid_splash_addon.core.grid import LOCAL_SPACING, Grid  # noqa: E402
from liquid_splash_addon.core.network import (  # noqa: E402
    NetworkConfig,
    SplashNetwork,
    fold_norm,
    unfold,
)
from liquid_splash_addon.core.weights import (  # noqa: E402
    WeightsError,
    default_weights_path,
    load_generator,
    save_weights,
)

SMALL = NetworkConfig((4, 8, 8, 8), (1, 1, 1, 1), (1, 1, 1), latent_channels=2)
HEADER = {"velocity_scale": 5.0, "fastest": 6.0, "local_cells": 128, "local_spacing": LOCAL_SPACING}


def small_network(norm=True):
    """Return a small network whose batch norms have seen something."""
    torch.manual_seed(0)
    network = SplashNetwork(NetworkConfig(**{**SMALL.__dict__, "norm": norm}))
    if norm:
        network.train()
        for _ in range(3):
            network(torch.randn(2, 4, 32, 32, 32), torch.zeros(2))
    return network.eval()


def test_unfolding_is_the_inverse_of_taking_every_second_cell():
    fine = torch.arange(2 * 4 * 6 * 8.0).reshape(1, 2, 4, 6, 8)
    parts = [fine[:, :, a::2, b::2, c::2] for a in (0, 1) for b in (0, 1) for c in (0, 1)]
    packed = torch.stack(parts, dim=2).flatten(1, 2)
    assert (unfold(packed) == fine).all()


def test_folding_batch_norm_changes_nothing():
    network = small_network()
    x, scale, z = torch.randn(1, 4, 32, 32, 32), torch.zeros(1), torch.randn(1, 2, 8, 8, 8)
    with torch.no_grad():
        assert torch.allclose(network(x, scale, z), fold_norm(network)(x, scale, z), atol=1e-4)


def test_latent_zero_is_the_deterministic_answer():
    network = small_network()
    x, scale = torch.randn(1, 4, 32, 32, 32), torch.zeros(1)
    with torch.no_grad():
        plain = network(x, scale)
        assert torch.allclose(plain, network(x, scale, torch.zeros(1, 2, 8, 8, 8)), atol=1e-6)
        assert not torch.allclose(plain, network(x, scale, torch.ones(1, 2, 8, 8, 8)), atol=1e-3)


def test_network_can_learn_a_pair_by_heart():
    torch.manual_seed(0)
    network = SplashNetwork(SMALL).train()
    x = (torch.rand(1, 4, 32, 32, 32) > 0.98).float()
    truth = torch.zeros(1, 32, 32, 32)
    truth[:, 4:19, 3:22, 6:12] = 1
    optimiser = torch.optim.Adam(network.parameters(), 2e-2)
    for _ in range(90):
        logit = network(x, torch.zeros(1))[:, 0]
        loss = torch.nn.functional.binary_cross_entropy_with_logits(
            logit, truth, pos_weight=torch.tensor(4.0)
        )
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    guess, there = logit[0] > 0, truth[0] > 0
    assert (guess & there).sum() / (guess | there).sum() > 0.9


def test_saved_weights_load_as_they_were(tmp_path):
    network = fold_norm(small_network())
    save_weights(network, HEADER, tmp_path / "w.safetensors")
    loaded = load_generator(tmp_path / "w.safetensors", "CPU")
    for name, tensor in network.state_dict().items():
        assert torch.allclose(loaded.network.state_dict()[name], tensor, atol=1e-3)
    assert loaded.config == network.config
    assert len(loaded.weights_hash) == 64


def test_bad_weights_files_say_what_to_do(tmp_path):
    good = tmp_path / "good.safetensors"
    save_weights(fold_norm(small_network()), HEADER, good)
    data = good.read_bytes()
    size = int.from_bytes(data[:8], "little")
    head = json.loads(data[8 : 8 + size])
    head["__metadata__"]["format"] = "something else"
    other = json.dumps(head).encode()
    cases = {
        "truncated": (data[: len(data) // 2], "damaged"),
        "cut in the header": (data[:20], "damaged"),
        "empty": (b"", "damaged"),
        "pickle": (b"\x80\x04" + bytes(100), "damaged"),
        "foreign": (len(other).to_bytes(8, "little") + other + data[8 + size :], "format"),
    }
    for name, (content, word) in cases.items():
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(WeightsError, match=word):
            load_generator(path)
    with pytest.raises(WeightsError, match="No weights at"):
        load_generator(tmp_path / "missing")


def test_bundled_weights_fit_the_grid_and_the_size_limit():
    generator = load_generator(device="CPU")
    assert generator.header["local_spacing"] == LOCAL_SPACING
    assert default_weights_path().stat().st_size <= 25e6


def test_latents_are_reproducible_and_scaled():
    first, same, other = (draw_latent(SMALL, seed, 1.0) for seed in (1, 1, 2))
    assert (first == same).all() and not (first == other).any()
    assert np.allclose(draw_latent(SMALL, 1, 0.5), 0.5 * first)
    assert draw_latent(SMALL, 1, 0.0) is None


def test_generator_refuses_what_it_cannot_use():
    generator = Generator(fold_norm(small_network()), HEADER, "", "cpu")
    grid = Grid((24, 16, 16), 0.01, (0, 0, 0))
    with pytest.raises(ValueError, match="multiple of 16"):
        generator.generate(np.zeros((4, 24, 16, 16), np.float32), grid)
    with pytest.raises(ValueError, match="no obstacle"):
        condition = np.zeros((4, 16, 16, 16), np.float32)
        generator.generate(condition, grid, obstacle=np.zeros((16, 16, 16)))


def test_distance_agrees_with_occupancy():
    rng = np.random.default_rng(0)
    occupancy = rng.random((8, 8, 8), dtype=np.float32)
    distance = rng.uniform(-3, 3, (8, 8, 8)).astype(np.float32)
    fields = settle(
        occupancy, distance, np.ones((3, 8, 8, 8), np.float32), Grid((8,) * 3, 1, (0,) * 3)
    )
    assert ((fields.distance < 0) == (occupancy > 0.5)).all()
    assert (np.abs(fields.distance) >= 0.1 - 1e-6).all()
