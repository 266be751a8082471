# SPDX-License-Identifier: GPL-3.0-or-later
"""Turning a drawing's units and seconds into the liquid's."""

import numpy as np
import pytest

from liquid_splash_addon.core.scale import GRAVITY, Scale

SCALE = Scale(length=0.15, time=0.4)


@pytest.mark.parametrize("what", ["lengths", "velocities", "accelerations", "durations"])
def test_there_and_back(what):
    there, back = getattr(SCALE, f"{what}_to_local"), getattr(SCALE, f"{what}_to_drawing")
    values = np.array([0.0, 1.0, -2.5])
    assert back(there(values)) == pytest.approx(values)
    assert back(there(np.float32([3.0]))).dtype == np.float32


def test_a_throw_is_the_same_throw_in_drawing_and_liquid():
    """Position, velocity and gravity, turned over one by one, must go on fitting together."""
    height, speed, seconds = 2.0, 3.0, 0.7  # drawn
    drawn = height + speed * seconds - SCALE.gravity * seconds**2 / 2
    t = SCALE.durations_to_local(seconds)
    local = (
        SCALE.lengths_to_local(height) + SCALE.velocities_to_local(speed) * t - GRAVITY * t**2 / 2
    )
    assert SCALE.lengths_to_drawing(local) == pytest.approx(drawn)


def test_slow_motion():
    slow = SCALE.slowed(1 / 20)
    assert slow.velocities_to_drawing(8.0) == pytest.approx(SCALE.velocities_to_drawing(8.0) / 20)
    assert slow.gravity == pytest.approx(SCALE.gravity / 400)
    assert slow.durations_to_local(1.0) == pytest.approx(SCALE.durations_to_local(1.0) / 20)
    assert slow.length == SCALE.length
    assert SCALE.slowed(0.5).slowed(0.1).time == pytest.approx(SCALE.slowed(0.05).time)


def test_a_larger_drawing_of_the_same_liquid():
    large = SCALE.resized(3.0)
    assert large.lengths_to_drawing(1.0) == pytest.approx(3 * SCALE.lengths_to_drawing(1.0))
    assert large.gravity == pytest.approx(3 * SCALE.gravity)


def test_strokes_are_read_in_their_own_seconds():
    assert Scale.of_length(0.1) == Scale(0.1, 1.0)
    assert Scale.of_length(0.1).gravity == pytest.approx(98.1)
