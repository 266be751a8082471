# SPDX-License-Identifier: GPL-3.0-or-later
"""Noise that lies along a flow."""

import numpy as np
import pytest

from liquid_splash_addon.core.liquid.streaks import A_WAVE, STEPS, TEXELS, along_flow, noise

WAVE, CELL = 0.02, 0.004
"""Metres."""


def flow(shape=(60, 60, 6), direction=(1.0, 0.0, 0.0)):
    """Return a velocity ``(3, X, Y, Z)`` that is the same everywhere."""
    return np.tile(np.float32(direction)[:, None, None, None], (1, *shape))


def plane(velocity, level=None, seed=0, variation=0.0):
    """Return streaks, beads and nearness of the front ``(3, X, Y)`` in one plane of cells."""
    shape = velocity.shape[1:]
    level = np.full(shape, -1, dtype=np.float32) if level is None else level
    x, y = np.mgrid[: shape[0], : shape[1]]
    places = np.stack([x + 0.5, y + 0.5, np.full(x.shape, 3.0)], axis=-1).reshape(-1, 3)
    found = along_flow(noise(seed, variation), places, np.zeros(3), velocity, level, WAVE, CELL)
    return found.reshape(3, *x.shape)


def likeness(values, axis, cells):
    """Return the correlation of values with those some cells on along an axis."""
    size = values.shape[axis]
    near, far = (values.take(range(*ends), axis) for ends in ((0, size - cells), (cells, size)))
    return np.corrcoef(near.ravel(), far.ravel())[0, 1]


def test_noise_has_its_wavelength_and_repeats_without_a_seam():
    made = noise(0, 0.0)
    assert made.shape == (TEXELS,) * 3
    between = made
    for axis in range(3):  # the mean square halfway and at texels is that of all places, nearly
        between = np.stack([between, (between + np.roll(between, 1, axis)) / 2])
        between = np.concatenate(between, axis=axis)
    assert between.std() == pytest.approx(1.0, abs=0.1)
    power = np.abs(np.fft.fftn(made)) ** 2
    waves = np.linalg.norm(np.stack(np.meshgrid(*[np.fft.fftfreq(TEXELS)] * 3)), axis=0)
    assert (power * waves).sum() / power.sum() == pytest.approx(1 / A_WAVE, rel=0.05)


def test_seeds_differ_as_far_as_they_may_vary():
    first = noise(1, 0.0)
    np.testing.assert_array_equal(first, noise(2, 0.0))
    alike = [
        np.corrcoef(noise(1, much).ravel(), noise(2, much).ravel())[0, 1] for much in (0.2, 1.0)
    ]
    assert alike[0] > 0.7 and abs(alike[1]) < 0.1


@pytest.mark.parametrize("axis", (0, 1))
def test_streaks_lie_along_the_flow_and_beads_across_it(axis):
    streaks, beads, _ = plane(flow(direction=np.eye(3)[axis]))
    assert likeness(streaks, axis, 3) > 0.8 > 0.3 > likeness(streaks, 1 - axis, 3)
    half = round(1.3 * WAVE / CELL / 2)  # from crest to trough
    assert likeness(beads, axis, half) < -0.5
    for found in (streaks, beads):
        assert found.std() == pytest.approx(1.0, abs=0.3)


def test_no_speed_matters_and_unknown_velocity_ends_no_streak():
    expected = plane(flow())
    np.testing.assert_allclose(plane(0.01 * flow()), expected, atol=1e-4)
    known = flow()
    known[:, 40:] = 0
    np.testing.assert_allclose(plane(known)[:2, 20:40], expected[:2, 20:40], atol=1e-4)


def test_the_front_is_where_the_liquid_ends_ahead():
    level = np.full((60, 60, 6), -1, dtype=np.float32)
    level[45:] = 1
    front = plane(flow(), level)[2]
    assert (front[44] > 0.8).all() and (front[: 45 - 2 * STEPS] < 1e-6).all()
    assert (np.diff(front[30:45, 0]) >= 0).all()
    assert (plane(flow(direction=(-1, 0, 0)), level)[2][20:45] < 1e-6).all(), "it ends behind"
