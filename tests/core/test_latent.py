# SPDX-License-Identifier: GPL-3.0-or-later
"""What makes a splash of one seed another than that of the next."""

from itertools import combinations

import numpy as np
import pytest

from liquid_splash_addon.core.generator.latent import (
    candidates,
    draw_latent,
    latent_shape,
    opposites,
)

pytest.importorskip("torch")

from liquid_splash_addon.core.generator.splash_unet import NetworkConfig

CONFIG = NetworkConfig()  # four numbers for the whole, four for each part


def whole(latent):
    """Return the numbers for the whole splash, ``(4,)``, checked to be the same everywhere."""
    assert (latent[:4] == latent[:4, :1, :1, :1]).all()
    return latent[:4, 0, 0, 0]


def test_latents_are_reproducible_and_scaled():
    first, same, other = (draw_latent(CONFIG, seed, 1.0) for seed in (1, 1, 2))
    assert first.shape == latent_shape(CONFIG) and first.dtype == np.float32
    assert (first == same).all() and not (first == other).any()
    assert np.allclose(draw_latent(CONFIG, 1, 0.5), 0.5 * first)
    assert draw_latent(CONFIG, 1, 0.0) is None


def test_seeds_in_a_row_are_as_unlike_as_they_can_be():
    """Of eight, seven are at right angles to each or opposite, and all as far from zero."""
    for first in (0, 8, 800):
        numbers = np.array([whole(draw_latent(CONFIG, first + i, 1.0)) for i in range(8)])
        np.testing.assert_allclose((numbers**2).sum(axis=1), 4, rtol=1e-5)
        products = numbers @ numbers.T
        np.testing.assert_allclose(
            np.sort(products, axis=1), [[-4, 0, 0, 0, 0, 0, 0, 4]] * 8, atol=1e-5
        )


def test_seeds_together_have_the_variance_of_latents_drawn_alone():
    numbers = np.array([whole(draw_latent(CONFIG, seed, 1.0)) for seed in range(800)])
    assert np.abs(numbers.mean(axis=0)).max() < 1e-5
    np.testing.assert_allclose(np.cov(numbers.T), np.eye(4), atol=0.01)
    # Each group is turned its own way.
    groups = numbers.reshape(-1, 8, 4)
    assert all(np.abs(a - b).max() > 0.1 for a, b in combinations(groups[:20], 2))


def test_the_other_numbers_differ_from_part_to_part():
    parts = draw_latent(CONFIG, 5, 1.0)[4:]
    assert abs(parts.mean()) < 0.1 and abs(parts.std() - 1) < 0.05
    assert not np.allclose(parts, draw_latent(CONFIG, 6, 1.0)[4:], atol=0.1)


def test_candidates_in_training_are_as_seeds_in_a_row():
    drawn = candidates(CONFIG, 12, np.random.default_rng(0))
    assert drawn.shape == (12, *latent_shape(CONFIG)) and drawn.dtype == np.float32
    numbers = np.array([whole(latent) for latent in drawn])
    np.testing.assert_allclose(numbers[:4] @ numbers[:4].T, 4 * np.eye(4), atol=1e-5)
    np.testing.assert_allclose(numbers[4:8], -numbers[:4])
    assert np.abs(numbers[8:] - numbers[:4]).max() > 0.1  # the next group
    assert abs(drawn[:, 4:].std() - 1) < 0.05


def test_one_number_has_two_opposites():
    np.testing.assert_allclose(np.abs(opposites(np.random.default_rng(0), 1)), [[1.0], [1.0]])
