# SPDX-License-Identifier: GPL-3.0-or-later
"""What viscosity and surface tension do, against closed forms."""

from dataclasses import fields

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from liquid_splash_addon.core.liquid.viscosity import for_breakup
from liquid_splash_addon.core.liquids import LIQUIDS, WATER, Liquid, slowing, swept
from liquid_splash_addon.core.refinement.presets import PRESETS
from liquid_splash_addon.core.refinement.settings import KINDS, SheetSettings, WaveSettings
from liquid_splash_addon.core.refinement.viscous import for_liquid
from liquid_splash_addon.core.settings import SplashSettings

RADIUS = 0.0015


def fastest(liquid: Liquid, radius: float) -> tuple[float, float]:
    """Return the fastest growth rate (1/s) of long waves on a thread, and its wavenumber (1/m).

    The positive root of w^2 + 3 nu k^2 w = sigma / (2 rho a^3) (ka)^2 (1 - (ka)^2) (Weber 1931).
    """
    nu = liquid.viscosity / liquid.density

    def rate(x: float) -> float:
        force = liquid.pull / (2 * radius**3) * x**2 * (1 - x**2)
        return brentq(lambda w: w**2 + 3 * nu * (x / radius) ** 2 * w - force, 0, 1e4)

    best = minimize_scalar(lambda x: -rate(x), bounds=(1e-3, 0.999), method="bounded")
    return rate(best.x), best.x / radius


@pytest.mark.parametrize("name", LIQUIDS)
def test_threads_break_as_slowly_as_weber_says(name):
    liquid = LIQUIDS[name]
    inviscid = Liquid("", "", liquid.tension, liquid.density, 1e-9)
    rate, wavenumber = fastest(liquid, RADIUS)
    quick, short = fastest(inviscid, RADIUS)
    water = fastest(WATER, RADIUS), fastest(Liquid("", "", 0.0728, 998.0, 1e-9), RADIUS)
    slower = (quick / rate) / (water[1][0] / water[0][0])
    assert slowing(liquid, RADIUS) == pytest.approx(slower, rel=0.01)
    longer = (short / wavenumber) / (water[1][1] / water[0][1])
    assert np.sqrt(slowing(liquid, RADIUS)) == pytest.approx(longer, rel=0.01)


def test_a_films_edge_is_held_back_as_long_as_the_film_thickens():
    honey = LIQUIDS["HONEY"]
    tau = 2 * (honey.viscosity - WATER.viscosity) * 0.001 / honey.tension
    times = np.linspace(0, 0.05, 200001)
    speed = 1 - np.exp(-times / tau)
    assert swept(honey, 0.001, 0.05) == pytest.approx(speed.mean(), rel=1e-4)
    assert swept(WATER, 0.001, 0.05) == 1.0


def test_water_leaves_all_as_it_is():
    for preset in PRESETS.values():
        assert for_liquid(preset.steps, "WATER") == list(preset.steps)
    settings = SplashSettings(breakup=1.7)
    assert for_breakup(settings) is settings
    assert "liquid" not in repr(settings), "splashes of older files are known by it"
    assert "liquid='HONEY'" in repr(SplashSettings(liquid="HONEY"))
    assert slowing(WATER, RADIUS) == 1.0


@pytest.mark.parametrize("name", LIQUIDS)
def test_settings_stay_within_their_limits_at_both_ends_of_all_sliders(name):
    for kind in KINDS.values():
        limits = {item.name: item.metadata for item in fields(kind)}
        for end in ("low", "high"):
            step = kind(**{item: limit[end] for item, limit in limits.items()})
            (made,) = for_liquid([step], name)  # raises ValueError beyond the limits
            assert type(made) is kind


def test_thick_liquids_keep_strands_where_water_sheds_drops():
    steps = [SheetSettings(), WaveSettings()]
    sheets = [for_liquid(steps, name)[0] for name in ("WATER", "MILK", "PAINT", "HONEY")]
    drops = [step.drops for step in sheets]
    assert drops == sorted(drops, reverse=True) and drops[-1] < 0.02 * drops[0]
    assert drops[1] > 0.9 * drops[0], "milk is hardly thicker than water"
    fingers = [step.fingers for step in sheets]
    assert fingers == sorted(fingers) and fingers[-1] > 2 * fingers[0]
    heights = [for_liquid(steps, name)[1].amplitude for name in ("WATER", "PAINT", "HONEY")]
    assert heights[1] < 0.3 * heights[0] and heights[2] < 0.05 * heights[0]
    assert for_liquid([SheetSettings(fingers=0)], "HONEY")[0].fingers == 0, "none are none"


def test_waves_of_other_liquids_are_as_long_and_as_fast_as_their_tension_lets_them():
    water, wine = (for_liquid([WaveSettings()], name)[0] for name in ("WATER", "WINE"))
    assert wine.wavelength == pytest.approx(water.wavelength)
    wanted = np.sqrt(LIQUIDS["WINE"].pull / WATER.pull)
    assert wine.speed / water.speed == pytest.approx(wanted)
