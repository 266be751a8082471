# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed from what a pen recorded."""

import numpy as np
import pytest

from liquid_splash_addon.core.scale import Scale
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import (
    Drawing,
    estimate_velocity,
    strokes_from_drawings,
    tangents,
    usable_drawings,
)
from liquid_splash_addon.core.sketch.strokes import StrokeError


def arc(speed, points=80, radius=1.0):
    """Return points and times of three quarters of a circle drawn at constant speed."""
    angle = np.linspace(0, 1.5 * np.pi, points)
    path = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return path, angle * radius / speed


@pytest.mark.parametrize("speed", [0.3, 2.0, 9.0])
def test_constant_speed_is_found(speed):
    path, times = arc(speed)
    found = np.linalg.norm(estimate_velocity(path, times), axis=1)
    assert np.abs(found / speed - 1).max() < 0.02


def test_jittered_and_clumped_times_do_little_harm():
    rng = np.random.default_rng(0)
    path, times = arc(2.0, points=200)
    # Events are handled in clumps: each time is that of the next clump, 8 ms apart.
    clumped = np.ceil((times + rng.uniform(0, 0.002, len(times))) / 0.008) * 0.008
    found = np.linalg.norm(estimate_velocity(path, clumped), axis=1)
    assert np.abs(np.median(found) / 2.0 - 1) < 0.05
    assert np.abs(found / 2.0 - 1).max() < 0.35


def test_direction_is_that_of_drawing():
    path, times = arc(2.0)
    velocity = estimate_velocity(path, times)
    tangent = np.stack([-path[:, 1], path[:, 0], 0 * path[:, 0]], axis=1)
    assert (velocity * tangent).sum(axis=1).min() > 0.97 * 2.0


def test_half_the_speed_gives_half_the_velocity():
    path, times = arc(2.0)
    assert np.allclose(estimate_velocity(path, 2 * times, 0.12), estimate_velocity(path, times) / 2)


def test_a_pause_is_slow():
    path = np.stack([np.linspace(0, 1, 101), np.zeros(101), np.zeros(101)], axis=1)
    times = np.linspace(0, 1, 101) + (np.arange(101) > 50) * 0.5
    speed = np.linalg.norm(estimate_velocity(path, times), axis=1)
    assert speed[20] == pytest.approx(1.0, rel=0.01)
    assert speed[50] < 0.6


def test_a_stalled_interface_does_not_make_liquid_explode():
    path, times = arc(2.0, points=200)
    # Half of the stroke's events were handled in one burst of 5 ms after the stall.
    burst = times.copy()
    burst[60:160] = times[159] + np.linspace(0, 0.005, 100)
    burst[160:] += 0.005
    speed = np.linalg.norm(estimate_velocity(path, burst), axis=1)
    assert speed.max() < 4.1 * 2.0


def test_sources():
    path, times = arc(2.0)
    timed = Drawing(path, times, np.full(len(path), 0.5))
    scale = Scale(0.1)
    speeds = {}
    for source in ("TIME", "PRESSURE", "CONSTANT"):
        settings = SplashSettings(speed_source=source, stroke_speed=0.5)
        (stroke,), warnings = strokes_from_drawings([timed], settings, scale)
        assert not warnings
        speeds[source] = np.median(np.linalg.norm(stroke.velocities, axis=1))
    assert speeds == pytest.approx({"TIME": 2.0, "PRESSURE": 2.5, "CONSTANT": 5.0}, rel=0.02)


def test_missing_times_fall_back_with_a_warning():
    path, times = arc(2.0)
    drawings = [Drawing(path, times), Drawing(path, np.zeros(len(path)))]
    strokes, warnings = strokes_from_drawings(
        drawings, SplashSettings(stroke_speed=0.4), Scale(0.1)
    )
    assert np.linalg.norm(strokes[1].velocities, axis=1) == pytest.approx(4.0, rel=1e-3)
    assert len(warnings) == 1 and "1 of 2 strokes have no recorded time" in warnings[0]


def test_times_that_are_not_numbers():
    path, times = arc(2.0)
    times[3] = np.nan
    with pytest.raises(StrokeError, match="time or pressure that is not a number"):
        strokes_from_drawings([Drawing(path, times)], SplashSettings())


@pytest.mark.parametrize("place", [0, 1])
def test_drawings_that_cannot_be_used_are_left_out(place):
    path, times = arc(2.0)
    good, bad = Drawing(path, times), Drawing(np.zeros((1, 3)))
    drawings = [good, good]
    drawings.insert(place, bad)
    strokes, warnings = strokes_from_drawings(drawings, SplashSettings(), Scale(0.1))
    assert len(strokes) == 2 and "Left out 1 stroke(s) of a single point" in warnings[0]
    usable, left_out, _ = usable_drawings(drawings)
    assert usable == [good, good] and left_out == [place]


def test_a_closed_window_takes_the_direction_of_its_segment():
    """Many turns of a small circle: the window closes on itself, the flow must not vanish."""
    angle = np.linspace(0, 64 * np.pi, 2000)
    path = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    along = np.linalg.norm(tangents(path), axis=1)
    assert np.allclose(along, 1.0)
