# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameter list."""

from dataclasses import fields

import pytest

from liquid_splash_addon.core.settings import MotionSettings, SplashSettings


def test_every_setting_can_be_shown():
    for item in (*fields(SplashSettings), *fields(MotionSettings)):
        assert item.metadata["label"] and item.metadata["description"]
        assert "items" in item.metadata or item.metadata["low"] < item.metadata["high"]


@pytest.mark.parametrize(
    "wrong", [{"real_size": -1.0}, {"resolution": "100"}, {"seed": -1}, {"speed_gain": 0.0}]
)
def test_values_outside_the_limits_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        SplashSettings(**wrong)


@pytest.mark.parametrize(
    ("time_scale", "label"),
    [(0.05, "1/20 speed"), (1.0, "Real speed"), (0.3, "1/3.33 speed"), (2.0, "2 times real speed")],
)
def test_slow_motion_in_words(time_scale, label):
    assert MotionSettings(time_scale=time_scale).speed_label == label
