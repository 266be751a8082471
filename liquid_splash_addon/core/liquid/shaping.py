# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done to the generator's liquid before it is meshed and stored."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..condition.similarity import AS_IT_IS
from ..grid import LOCAL_SPACING
from ..scale import Scale
from ..settings import SplashSettings
from ..sketch.strokes import Stroke
from .breakup import broken_up
from .edge_smoothing import smoothed_edges
from .fields import Fields
from .level_set import LevelSet, with_level
from .stroke_reach import within_reach
from .viscosity import for_breakup


def shaped(
    fields: Fields, strokes: Sequence[Stroke], settings: SplashSettings, model: Scale = AS_IT_IS
) -> Fields:
    """Return the generator's liquid at its real size, with smooth edges, kept to Reach, broken up.

    fields : the generator's answer; model : how real metres and seconds are measured in it, see
    :mod:`..condition.similarity`; strokes : in real metres and m/s.
    """

    def smoothed(liquid: LevelSet) -> LevelSet:
        return replace(smoothed_edges(replace(liquid, grid=fields.grid)), grid=liquid.grid)

    def parted(liquid: LevelSet) -> LevelSet:
        # In the model, whose Weber number is the real one's: sigma / rho is length^3 / time^2.
        seen = [
            Stroke(model.lengths_to_local(s.points), model.velocities_to_local(s.velocities))
            for s in strokes
        ]
        there = LevelSet(liquid.level, fields.velocity, fields.grid)
        liquid_settings = for_breakup(settings, model.lengths_to_drawing(LOCAL_SPACING))
        broken = broken_up(there, seen, liquid_settings, model.length**3 / model.time**2)
        return replace(broken, velocity=liquid.velocity, grid=liquid.grid)

    return reshaped(
        fields.seen_through(model),
        smoothed,
        lambda liquid: within_reach(liquid, strokes, settings.reach),
        parted,
    )


def reshaped(fields: Fields, *steps: Callable[[LevelSet], LevelSet]) -> Fields:
    """Return the fields after ``steps`` on their level set; where nothing changed, they are kept.

    The occupancy becomes a level once, before the first step, and that occupancy after the last.
    """
    before = liquid = LevelSet.of(fields)
    for step in steps:
        liquid = step(liquid)
    return with_level(fields, before.level, liquid.level)
