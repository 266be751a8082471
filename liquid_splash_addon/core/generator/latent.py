# SPDX-License-Identifier: GPL-3.0-or-later
"""The generator's latent, by which splashes of different seeds differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .splash_unet import NetworkConfig


def latent_shape(config: NetworkConfig) -> tuple[int, int, int, int]:
    """Return the shape of one latent, over the whole local box: ``(L, l, l, l)``."""
    return (config.latent_channels, *(config.latent_cells,) * 3)


def whole_channels(config: NetworkConfig) -> int:
    """Return how many channels, the first ones, hold one number for the whole splash.

    The others hold one for each part of it. With thousands of free numbers, the best of a few draws
    (IMLE) is hardly better than any other, and nothing would be learned.
    """
    return max(config.latent_channels // 2, 1)


def draw_latent(config: NetworkConfig, seed: int, variation: float) -> np.ndarray | None:
    """Return the latent of ``seed``, float32 ``(L, l, l, l)``, of variance 1 times ``variation``^2.

    The lattice spans the local box, whatever the resolution, device or crop. Consecutive
    seeds are unlike: see :func:`opposites`. Variation 0 gives None, the deterministic answer.
    """
    if variation == 0:
        return None
    whole = whole_channels(config)
    group, place = divmod(seed, 2 * whole)
    latent = np.random.Generator(np.random.PCG64(seed)).standard_normal(latent_shape(config))
    turn = np.random.Generator(np.random.PCG64(np.random.SeedSequence(group, spawn_key=(1,))))
    set_whole(latent, opposites(turn, whole)[place])
    return (variation * latent).astype(np.float32)


def opposites(rng: np.random.Generator, dimensions: int) -> np.ndarray:
    """Return ``(2 n, n)`` points as far apart as they can be on the sphere of radius sqrt(n).

    A cross-polytope in a random orientation. Each point by itself is uniform on the sphere; but of
    2 n independent ones some would be much alike, and the best of them farther from the target.
    """
    turn, _ = np.linalg.qr(rng.standard_normal((dimensions, dimensions)))
    return np.sqrt(dimensions) * np.concatenate([turn.T, -turn.T])


def set_whole(latent: np.ndarray, numbers: np.ndarray) -> None:
    """Make ``numbers`` ``(..., n)`` the first channels of latents ``(..., L, l, l, l)``."""
    latent[..., : numbers.shape[-1], :, :, :] = numbers[..., None, None, None]


def candidates(config: NetworkConfig, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return latents as ``count`` consecutive seeds have them, float32 ``(count, L, l, l, l)``."""
    whole = whole_channels(config)
    groups = [opposites(rng, whole) for _ in range(-(-count // (2 * whole)))]
    latents = rng.standard_normal((count, *latent_shape(config)), dtype=np.float32)
    set_whole(latents, np.concatenate(groups)[:count])
    return latents
