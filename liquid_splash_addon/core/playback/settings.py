# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user chooses for how frames are shown, and which ones are baked."""

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


@dataclass(frozen=True)
class BakeSettings(Settings):
    """Which frames get a splash of their own, and what those are made of."""

    range: str = setting(
        "SCENE",
        "Frames",
        "Which frames of the timeline get a splash each",
        items=(
            ("SCENE", "Scene", "All frames of the scene, first to last"),
            ("OWN", "Chosen", "Those from First to Last"),
        ),
    )
    first: int = setting(1, "First", "First frame that gets a splash", low=0, high=1_000_000)
    last: int = setting(24, "Last", "Last frame that gets a splash", low=0, high=1_000_000)
    drawings: str = setting(
        "EACH",
        "Drawings",
        "Which drawing of an animated sketch the splashes are made of",
        items=(
            ("EACH", "Each Drawing", "Every frame's splash is made of the drawing of that frame"),
            ("CURRENT", "Current Drawing", "All are made of the drawing of the current frame"),
        ),
    )
