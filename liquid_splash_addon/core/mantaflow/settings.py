# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user chooses for a splash in Mantaflow."""

from __future__ import annotations

from dataclasses import dataclass

from ..settings import Settings, setting

BYTES_PER_CELL = 1000
"""Memory that a liquid takes in Mantaflow, its mesh included (measured: 2.1 GB at 128^3 cells)."""


@dataclass(frozen=True)
class MantaflowSettings(Settings):
    """What a user chooses for one export to Mantaflow. Units are in each description."""

    resolution: int = setting(
        96,
        "Resolution",
        "Voxels along the longest side of the domain. Twice as many take about 16 times the time",
        low=16,
        high=1024,
        soft=256,
    )
    margin: float = setting(
        0.5,
        "Margin",
        "Room around the splash, over its longest side. What leaves it is gone",
        low=0.05,
        high=10.0,
        soft=2.0,
    )
    frames: int = setting(
        60, "Frames", "Frames to simulate after the first, which is the splash itself",
        low=1, high=100_000, soft=250,
    )  # fmt: skip
    frame: int = setting(
        1, "First Frame", "Frame of the timeline that shows the splash itself",
        low=0, high=100_000,
    )  # fmt: skip
    ground: str = setting(
        "NONE",
        "Ground",
        "What lies below the splash",
        items=(
            ("NONE", "None", "Nothing: the liquid falls until it leaves the domain"),
            ("FLOOR", "Floor", "A level floor"),
            ("POOL", "Pool", "A pool of still liquid, joined with the splash, between walls"),
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
        0.25, "Pool Depth", "Depth of the pool, in the scene's units", low=1e-6, high=1e6
    )
    gravity: float = setting(
        1.0,
        "Gravity",
        "Gravity over the earth's at the splash's size. Where the scene has none, there is none",
        low=-10.0,
        high=10.0,
    )
    divergence_free: bool = setting(
        True,
        "Divergence-Free",
        "Remove the part of the velocity that the solver would remove in its first step: the "
        "first frames then are the flow that was drawn",
        low=False,
        high=True,
    )
    mesh: bool = setting(
        True, "Mesh", "Make a surface of the liquid after the simulation", low=False, high=True
    )
    hide: bool = setting(
        True,
        "Hide Splash",
        "Hide the splash once the liquid is baked: the domain shows it from then on",
        low=False,
        high=True,
    )
