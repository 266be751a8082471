# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user chooses for a simulation of a splash."""

from __future__ import annotations

from dataclasses import dataclass

from ..scale import GRAVITY as EARTH
from ..settings import Settings, setting


@dataclass(frozen=True)
class SimulationSettings(Settings):
    """What a user chooses for one simulation. Units are in each description."""

    frames: int = setting(
        60,
        "Frames",
        "Frames to simulate, not counting the first, which shows the splash as it is",
        low=1,
        high=10_000,
        soft=250,
    )
    resolution: str = setting(
        "128",
        "Resolution",
        "Voxels along the longest side of the splash",
        items=(
            ("64", "64 (Preview)", "Fast preview"),
            ("96", "96", "Between preview and full resolution"),
            ("128", "128", "Voxels of a full splash"),
            ("192", "192", "One and a half times as fine: about five times the time"),
            ("256", "256", "Twice as fine: about sixteen times the time"),
        ),
    )
    gravity: bool = setting(True, "Gravity", "The liquid falls", low=False, high=True)
    gravity_strength: float = setting(
        EARTH, "Strength (m/s²)", "Gravity, 9.81 on earth", low=0.0, high=100.0, soft=25.0
    )
    ground: str = setting(
        "NONE",
        "Ground",
        "What lies below the splash",
        items=(
            ("NONE", "None", "Nothing: the liquid falls until it leaves the domain"),
            ("FLOOR", "Floor", "A level floor"),
            (
                "POOL",
                "Pool",
                "A level floor with a basin of still liquid in it, joined with the splash",
            ),
        ),
    )
    ground_height: float = setting(
        0.0,
        "Height",
        "Height of the floor, or of the pool's surface, in the scene",
        low=-1e6,
        high=1e6,
    )
    pool_depth: float = setting(
        0.02, "Pool Depth (m)", "Depth of the pool, in metres at real size",
        low=0.0001, high=1000.0, soft=0.4,
    )  # fmt: skip
    tension: bool = setting(
        False,
        "Surface Tension",
        "That of water. It shapes drops and rims of a few millimetres and takes smaller steps",
        low=False,
        high=True,
    )
    least_substeps: int = setting(
        1, "Least Substeps", "Least time steps in a frame; fast liquid takes more", low=1, high=200
    )
    margin: float = setting(
        0.5,
        "Margin",
        "Room around the splash, over its longest side. What leaves it is gone",
        low=0.1,
        high=4.0,
        soft=2.0,
    )

    @property
    def cells(self) -> int:
        """Voxels along the longest side of the splash."""
        return int(self.resolution)

    @property
    def pull(self) -> float:
        """Gravity that acts, m/s^2."""
        return self.gravity_strength if self.gravity else 0.0


@dataclass(frozen=True)
class FlowOnSettings(Settings):
    """What a user chooses for a splash some time later."""

    milliseconds: float = setting(
        0.0,
        "Flow On (ms)",
        "Milliseconds of the liquid's own time that the splash flows on, before its refinements: "
        "sheets become thinner and smoother, rims form. Press the button to compute it",
        low=0.0,
        high=10_000.0,
        soft=100.0,
    )
    gravity: bool = setting(True, "Gravity", "The liquid falls meanwhile", low=False, high=True)
    gravity_strength: float = setting(
        EARTH, "Strength (m/s²)", "Gravity, 9.81 on earth", low=0.0, high=100.0, soft=25.0
    )
