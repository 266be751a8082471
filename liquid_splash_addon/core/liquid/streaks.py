# SPDX-License-Identifier: GPL-3.0-or-later
"""Disturbances that lie along a flow: streaks, and waves that run along them.

Noise of one wavelength is averaged along the streamline through each place (line integral
convolution, Cabral and Leedom 1993). What varies across the flow stays, so streaks are left. With
a window that swings (a Gabor function), it is what varies along the flow that stays.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..compiling import njit
from ..numeric.threads import in_parts

TEXELS, A_WAVE = 64, 5.0
"""Texels along each side of the periodic noise, and to each of its wavelengths."""

LENGTHS = (0.85, 1.15)
"""Range of the noise's wavenumbers over the mean one."""

STEPS, A_STEP = 6, 0.33
"""Steps along the streamline to each side, and their length over the wavelength."""

SWING = 1.3
"""Distance from crest to crest along the flow, over the noise's wavelength."""


@lru_cache(maxsize=4)
def noise(seed: int, variation: float) -> np.ndarray:
    """Return periodic noise, float32 ``(TEXELS,) * 3``; treat it as read-only.

    Sampled trilinearly, it has a mean square of 1. Its wavelengths are A_WAVE texels, by LENGTHS.
    seed, variation : each seed's phases differ from those of all others by as much as the
    variation, 0..1, allows.
    """
    from scipy.fft import irfftn

    whole, half = np.fft.fftfreq(TEXELS), np.fft.rfftfreq(TEXELS)
    size = np.sqrt(whole[:, None, None] ** 2 + whole[None, :, None] ** 2 + half**2) * A_WAVE
    met = np.nonzero((size > LENGTHS[0]) & (size < LENGTHS[1]))
    phases = np.random.default_rng(0).uniform(0, 2 * np.pi, len(met[0]))
    phases += variation * np.random.default_rng(seed).uniform(0, 2 * np.pi, len(met[0]))
    modes = np.zeros(size.shape, dtype=np.complex64)
    modes[met] = np.exp(1j * phases)
    made = irfftn(modes, s=(TEXELS,) * 3)
    # What linear interpolation between texels leaves of the square of a wave, along each axis.
    turns = [2 * np.pi * axis[n] for axis, n in zip((whole, whole, half), met, strict=True)]
    left = np.prod([(2 + np.cos(turn)) / 3 for turn in turns], axis=0).mean()
    return np.asarray(made / (made.std() * np.sqrt(left)), dtype=np.float32)


def windows() -> np.ndarray:
    """Return the weights of the steps from the last behind to the last ahead, ``(2, 2 n + 1)``.

    float32; of streaks and of the waves along them. What is left of the noise in a straight flow
    has a mean square of 1.
    """
    places = np.arange(-STEPS, STEPS + 1) * A_STEP
    bell = np.cos(np.pi / 2 * places / (STEPS + 1) / A_STEP) ** 2
    both = np.stack([bell, bell * np.cos(2 * np.pi * places / SWING)])
    # The directions of the noise's waves are spread evenly over a sphere, so what they vary along
    # the flow is spread evenly over -1..1 of their wavenumber (Archimedes).
    along = np.linspace(-1, 1, 201)
    left = both @ np.cos(2 * np.pi * places[:, None] * along)
    return np.asarray(both / np.sqrt((left**2).mean(axis=1))[:, None], dtype=np.float32)


def along_flow(
    made: np.ndarray,
    places: np.ndarray,
    shift: np.ndarray,
    velocity: np.ndarray,
    level: np.ndarray,
    wavelength: float,
    cell: float,
) -> np.ndarray:
    """Return streaks, waves along them, and how near the liquid's front is, float32 ``(3, n)``.

    The front is the end of the liquid ahead: 1 there, 0 from STEPS steps before it on.

    made : see :func:`noise`; places : in the liquid, cells ``(n, 3)``; shift : from there to
    the place in the noise, cells; velocity : ``(3, X, Y, Z)``, 0 where none is known: the last
    direction is kept there; level : ``(X, Y, Z)``, negative in
    the liquid; wavelength : of the noise, metres; cell : the side of one, metres.
    """
    out = np.zeros((len(places), 3), dtype=np.float32)
    places, shift = np.asarray(places, dtype=np.float32), np.asarray(shift, dtype=np.float32)
    weights = windows()
    step, texels = np.float32(A_STEP * wavelength / cell), np.float32(A_WAVE * cell / wavelength)

    def follow(begin: int, end: int) -> None:
        part = places[begin:end], shift, velocity, level, step, texels, weights, out[begin:end]
        _follow(made, *part)

    in_parts(len(places), follow)
    return out.T


@njit(cache=True, fastmath=True)
def _sampled(made, x, y, z):
    """Return periodic noise at a place in texels."""
    i, j, k = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
    a, b, c = x - i, y - j, z - k
    last = TEXELS - 1  # TEXELS is a power of two
    i0, j0, k0, i1, j1, k1 = i & last, j & last, k & last, i + 1 & last, j + 1 & last, k + 1 & last
    low = (made[i0, j0, k0] * (1 - c) + made[i0, j0, k1] * c) * (1 - b)
    low += (made[i0, j1, k0] * (1 - c) + made[i0, j1, k1] * c) * b
    high = (made[i1, j0, k0] * (1 - c) + made[i1, j0, k1] * c) * (1 - b)
    high += (made[i1, j1, k0] * (1 - c) + made[i1, j1, k1] * c) * b
    return low * (1 - a) + high * a


@njit(cache=True, fastmath=True)
def _follow(made, places, shift, velocity, level, step, texels, weights, out):
    """Write streaks, waves along them and nearness of the front at ``places`` into ``out``."""
    nx, ny, nz = level.shape
    a, b, c = shift
    for n in range(len(places)):
        x, y, z = places[n]
        value = _sampled(made, (x + a) * texels, (y + b) * texels, (z + c) * texels)
        out[n, 0], out[n, 1] = weights[0, STEPS] * value, weights[1, STEPS] * value
        for side in (-1, 1):
            x, y, z = places[n]
            dx = dy = dz = np.float32(0)
            inside = STEPS
            for number in range(1, STEPS + 1):
                i = min(max(int(x), 0), nx - 1)
                j = min(max(int(y), 0), ny - 1)
                k = min(max(int(z), 0), nz - 1)
                if number <= inside and level[i, j, k] > 0.5:
                    inside = number - 1
                u, v, w = velocity[0, i, j, k], velocity[1, i, j, k], velocity[2, i, j, k]
                speed = np.sqrt(u * u + v * v + w * w)
                if speed > 0:
                    scale = side * step / speed
                    dx, dy, dz = u * scale, v * scale, w * scale
                x, y, z = x + dx, y + dy, z + dz
                value = _sampled(made, (x + a) * texels, (y + b) * texels, (z + c) * texels)
                out[n, 0] += weights[0, STEPS + side * number] * value
                out[n, 1] += weights[1, STEPS + side * number] * value
            if side == 1:
                out[n, 2] = 1 - np.float32(inside) / STEPS
