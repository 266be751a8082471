# SPDX-License-Identifier: GPL-3.0-or-later
"""The default gain takes what a hand draws with a mouse into the speeds that were trained on.

A hand's reach has a bell-shaped profile of speed, that of least jerk: t^3 (10 - 15 t + 6 t^2) of
its way at a share t of its time (Flash and Hogan, J. Neurosci. 5(7), 1985), 1.875 times as fast in
the middle as in the mean.
"""

from __future__ import annotations

import numpy as np
import pytest

from liquid_splash_addon.core.condition.similarity import model_scale
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import Drawing, strokes_from_drawings
from liquid_splash_addon.core.sketch.fit_speed import fitting_gain
from liquid_splash_addon.core.sketch.local_frame import fit_frame
from liquid_splash_addon.core.sketch.polyline import interpolated
from liquid_splash_addon.core.sketch.presets import PRESETS
from liquid_splash_addon.core.sketch.strokes import arc_length

FASTEST = 7.03
"""m/s, of the bundled weights."""

SLOWEST = 0.6
"""m/s: slow sheets have parted into drops at this speed."""

TICK = 0.008
"""Seconds between two events of a mouse."""


def by_hand(path: np.ndarray, seconds: float) -> Drawing:
    """Return a path ``(n, 3)`` as a hand draws it, at the events of a mouse."""
    times = np.arange(0, seconds + TICK / 2, TICK)
    share = times / times[-1]
    way = share**3 * (10 - 15 * share + 6 * share**2)
    along = arc_length(path)
    return Drawing(interpolated(way * along[-1], along, path.astype(np.float64)), times)


def sketches() -> dict[str, list[np.ndarray]]:
    """Return paths as artists draw them: presets, and bends twice as long as the sketch is wide."""
    found = {
        name.lower(): [path for paths in kind().paths().values() for path in paths]
        for name, kind in PRESETS.items()
        if name in ("CROWN", "JET", "SHEET", "WAVE")
    }
    turn = np.linspace(0, 2 * np.pi, 200)
    found["bends"] = [
        np.stack([turn / np.pi, 0.62 * np.sin(turn) + 0.1 * n, 0 * turn], axis=1) for n in range(6)
    ]
    return found


def speeds(name: str, seconds: float, **settings: float) -> list[np.ndarray]:
    """Return the speeds of the liquid along each stroke, m/s, in the model that is seen."""
    chosen = SplashSettings(**settings)
    drawings = [by_hand(path, seconds) for path in sketches()[name]]
    strokes, warnings = strokes_from_drawings(drawings, chosen)
    assert not warnings
    local = fit_frame(strokes, chosen.real_size).strokes_to_local(strokes, chosen.speed_gain)
    model = model_scale(local)
    return [model.velocities_to_local(np.linalg.norm(one.velocities, axis=1)) for one in local]


NAMES = ("crown", "jet", "sheet", "wave", "bends")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seconds", [0.45, 0.6, 1.0])
def test_a_mouse_sketch_is_in_the_trained_range(name, seconds):
    found = speeds(name, seconds)
    assert np.quantile(np.concatenate(found), 0.95) <= FASTEST, "no warning"
    if seconds < 1:
        assert np.median([np.median(one) for one in found]) >= SLOWEST


@pytest.mark.parametrize("name", NAMES)
def test_speeds_are_the_hands_own(name):
    """Twice as slow by hand is twice as slow in the liquid: no gain is fitted by itself."""
    quick, slow = (np.concatenate(speeds(name, seconds)) for seconds in (0.48, 0.96))
    ratio = np.quantile(quick, 0.9) / np.quantile(slow, 0.9)
    assert ratio == pytest.approx(2, rel=0.05)


def test_presets_are_as_fast_as_they_were():
    settings = SplashSettings()
    for kind in PRESETS.values():
        for drawings in kind(asymmetry=0.0).layers().values():
            strokes, _ = strokes_from_drawings(drawings, settings)
            frame = fit_frame(strokes, settings.real_size)
            local = frame.strokes_to_local(strokes, settings.speed_gain)
            mean = np.median(np.concatenate([np.linalg.norm(s.velocities, axis=1) for s in local]))
            assert 1.5 < mean < 4.5


def test_the_gain_that_is_fitted_lies_about_the_default():
    """For the sketches here, drawn in half a second."""
    gains = []
    for name in NAMES:
        drawings = [by_hand(path, 0.5) for path in sketches()[name]]
        strokes, _ = strokes_from_drawings(drawings, SplashSettings())
        local = fit_frame(strokes, SplashSettings().real_size).strokes_to_local(strokes)
        gains.append(fitting_gain(local, FASTEST))
    default = SplashSettings().speed_gain
    print("fitted gains:", dict(zip(NAMES, np.round(gains, 2), strict=True)))
    assert min(gains) < default * 1.5 and max(gains) > default / 1.5
