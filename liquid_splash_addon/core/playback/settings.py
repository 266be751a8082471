# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user chooses for how simulated frames are shown."""

from __future__ import annotations

from dataclasses import dataclass

from ..settings import Settings, setting


@dataclass(frozen=True)
class PlaybackSettings(Settings):
    """Which of the splash's refinements are evaluated on every frame."""

    waves: bool = setting(
        True,
        "Waves",
        "Put the waves of the list of refinements on every frame",
        low=False,
        high=True,
    )
    droplets: bool = setting(
        False,
        "New Drops",
        "Drops go on breaking off while the splash moves, as the droplets of the list of "
        "refinements say. Those that are there at the start move in any case",
        low=False,
        high=True,
    )
