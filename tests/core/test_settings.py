# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameter list."""

from dataclasses import fields

import pytest

from liquid_splash_addon.core.settings import SplashSettings


def test_every_setting_can_be_shown():
    for item in fields(SplashSettings):
        assert item.metadata["label"] and item.metadata["description"]
        assert "items" in item.metadata or item.metadata["low"] < item.metadata["high"]


@pytest.mark.parametrize(
    "wrong", [{"real_size": -1.0}, {"resolution": "100"}, {"seed": -1}, {"speed_gain": 0.0}]
)
def test_values_outside_the_limits_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        SplashSettings(**wrong)
