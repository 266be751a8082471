# SPDX-License-Identifier: GPL-3.0-or-later
"""The default refinements of the example crown at full resolution, and one slider of them."""

from collections.abc import Sequence

from liquid_splash_addon.core.liquid.fields import Fields
from liquid_splash_addon.core.mesh.marching_cubes import surface
from liquid_splash_addon.core.refinement.presets import PRESETS
from liquid_splash_addon.core.refinement.settings import (
    DropletSettings,
    RefinementSettings,
    SheetSettings,
    WaveSettings,
)
from liquid_splash_addon.core.refinement.sheet_mesh import prepare_sheets
from liquid_splash_addon.core.refinement.sheets import add_sheets
from liquid_splash_addon.core.refinement.stack import Refiner
from tests.benchmarks.synthesis import median_seconds, prepared


def measure() -> dict[str, float]:
    """Return this area's numbers."""
    fields = prepared("128")().fields
    return {
        "refinement.seconds_default": median_seconds(lambda: refine_anew(fields, DEFAULT)),
        "refinement.seconds_fresh": median_seconds(lambda: refine_anew(fields, FRESH)),
        "refinement.seconds_sheets": median_seconds(sheets(fields)),
        "refinement.seconds_sheet_slider": median_seconds(sheet_slider(fields)),
        "refinement.seconds_wave_slider": median_seconds(slider(fields)),
    }


DEFAULT = (DropletSettings(), WaveSettings())
FRESH = PRESETS["FRESH"].steps


def refine_anew(fields: Fields, steps: Sequence[RefinementSettings]) -> None:
    """Refine with nothing kept, surface included."""
    Refiner(fields).refine(steps)


def sheets(fields: Fields):
    """Return a call that makes the sheets of a surface that is already there."""
    mesh, cell = surface(fields), fields.grid.spacing
    return lambda: add_sheets(prepare_sheets(mesh, cell), SheetSettings())


def sheet_slider(fields: Fields):
    """Return a call that changes one slider of sheets, another value each time."""
    prepared_sheets = prepare_sheets(surface(fields), fields.grid.spacing)
    films = iter(range(1, 100))
    return lambda: add_sheets(prepared_sheets, SheetSettings(film=1 + 0.01 * next(films)))


def slider(fields: Fields):
    """Return a call that changes one wave slider of a refined splash, another value each time."""
    refiner = Refiner(fields)
    refiner.refine([DropletSettings(), WaveSettings()])
    heights = iter(range(1, 100))
    return lambda: refiner.refine(
        [DropletSettings(), WaveSettings(amplitude=0.001 + 1e-5 * next(heights))]
    )
