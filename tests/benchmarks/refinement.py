# SPDX-License-Identifier: GPL-3.0-or-later
"""The default refinements of the example crown at full resolution, and one slider of them."""

from liquid_splash_addon.core.liquid.fields import Fields
from liquid_splash_addon.core.refinement.settings import DropletSettings, WaveSettings
from liquid_splash_addon.core.refinement.stack import Refiner
from tests.benchmarks.synthesis import median_seconds, prepared


def measure() -> dict[str, float]:
    """Return this area's numbers."""
    fields = prepared("128")().fields
    return {
        "refinement.seconds_default": median_seconds(lambda: refine_anew(fields)),
        "refinement.seconds_wave_slider": median_seconds(slider(fields)),
    }


def refine_anew(fields: Fields) -> None:
    """Refine with nothing kept, surface included."""
    Refiner(fields).refine([DropletSettings(), WaveSettings()])


def slider(fields: Fields):
    """Return a call that changes one wave slider of a refined splash, another value each time."""
    refiner = Refiner(fields)
    refiner.refine([DropletSettings(), WaveSettings()])
    heights = iter(range(1, 100))
    return lambda: refiner.refine(
        [DropletSettings(), WaveSettings(amplitude=0.001 + 1e-5 * next(heights))]
    )
