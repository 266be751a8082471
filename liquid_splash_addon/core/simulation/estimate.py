# SPDX-License-Identifier: GPL-3.0-or-later
"""What a simulation will take, before it is begun."""

from __future__ import annotations

from typing import NamedTuple

from .settings import SimulationSettings
from .start import Start


class Estimate(NamedTuple):
    """What a simulation takes, to a factor of two.

    Attributes
    ----------
    particles : at the start
    memory : bytes, at most at once
    disc : bytes, all frames
    seconds : of one core of an ordinary computer
    """

    particles: int
    memory: float
    disc: float
    seconds: float


def estimate(start: Start, settings: SimulationSettings) -> Estimate:
    """Return what the simulation will take. A few milliseconds."""
    raise NotImplementedError
