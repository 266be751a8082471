# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of each kind of refinement; imports without any library that computes."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import ClassVar, Self

from ..settings import LATENT_SEED_MAX, Settings, setting

PARTICLE_STEP = 1 / 240
"""Seconds of a step of the particles' simulation; the default flight takes four."""

SMALL_DROP_PARTICLES, LARGE_DROP_PARTICLES = 100, 400
"""Particles around a sample point (paper, 5.1): of the smallest and the largest drop."""

SMALLEST_RADIUS, LARGEST_RADIUS = 0.75, 3.0
"""Range of the radii that a grid can resolve, cells; smaller drops are only points of the cloud."""

PARTICLES, MOST_PARTICLES = 50_000, 400_000

SEED_STRIDE = 1_000_003
"""From the seeds of a step on one splash to those on the next: odd, so that none are the same."""


@dataclass(frozen=True)
class RefinementSettings(Settings):
    """The settings of one step of refinement."""

    label: ClassVar[str]
    about: ClassVar[str]

    def of_splash(self, seed: int) -> Self:
        """Return the step as it is on the splash of a seed; 0 leaves it as it is.

        Different seeds of either give different ones; steps without a seed are alike on all.
        """
        if seed == 0 or all(item.name != "seed" for item in fields(self)):
            return self
        own: int = vars(self)["seed"]
        return replace(self, **{"seed": (own + SEED_STRIDE * seed) % (LATENT_SEED_MAX + 1)})


@dataclass(frozen=True)
class DropletSettings(RefinementSettings):
    """The settings of droplets."""

    label: ClassVar[str] = "Droplets"
    about: ClassVar[str] = "Drops that break off at the fronts"

    amount: float = setting(
        0.002,
        "Amount",
        "Share of the voxels under the surface that throw off drops: the most curved and most "
        "turbulent ones",
        low=0.0,
        high=1.0,
        soft=0.02,
    )
    size: float = setting(
        1.3, "Size", "Mean radius of the drops in voxels of the splash", low=0.3, high=3.0
    )
    spread: float = setting(
        0.35, "Spread", "How much the sizes vary (0: all the same)", low=0.0, high=1.0
    )
    flight: float = setting(
        0.0167, "Flight", "Time in seconds that the drops have flown: how far away they are",
        low=0.004, high=0.1,
    )  # fmt: skip
    cohesion: float = setting(
        0.5, "Cohesion", "How strongly drops hold together: 0 for spray, 1 for round drops",
        low=0.0, high=1.0,
    )  # fmt: skip
    turbulence: float = setting(
        4.0, "Turbulence", "Weight of the turbulence of the flow (alpha)", low=2.0, high=8.0
    )
    curvature: float = setting(
        4.0, "Curvature", "Weight of the curvature of the surface (beta)", low=2.0, high=8.0
    )
    particles: int = setting(
        PARTICLES, "Most Particles", "Limit on time and memory: about 1 kB each",
        low=SMALL_DROP_PARTICLES, high=MOST_PARTICLES,
    )  # fmt: skip
    seed: int = setting(
        0, "Seed", "Number that picks one of the possible sets of drops", low=0, high=2**31 - 1
    )


@dataclass(frozen=True)
class RuptureSettings(RefinementSettings):
    """The settings of ruptures."""

    label: ClassVar[str] = "Ruptures"
    about: ClassVar[str] = "Air that has broken into the fronts"

    amount: float = setting(
        0.03, "Amount", "Share of the fronts from which air breaks in",
        low=0.0, high=1.0, soft=0.2,
    )  # fmt: skip
    size: float = setting(
        1.5, "Size", "Mean radius of the air pockets in voxels of the splash", low=0.75, high=3.0
    )
    spread: float = setting(
        0.35, "Spread", "How much the sizes vary (0: all the same)", low=0.0, high=1.0
    )
    depth: float = setting(
        0.0167, "Depth", "Time in seconds that air has cut in along the flow: how deep it goes",
        low=0.004, high=0.1,
    )  # fmt: skip
    seed: int = setting(
        0, "Seed", "Number that picks one of the possible sets of ruptures", low=0, high=2**31 - 1
    )


@dataclass(frozen=True)
class WaveSettings(RefinementSettings):
    """The settings of capillary waves, with the ranges of the paper's Table 2."""

    label: ClassVar[str] = "Waves"
    about: ClassVar[str] = "Capillary waves that run from the fronts"

    amplitude: float = setting(
        0.0007,
        "Amplitude",
        "Height of the waves in metres where the surface is most curved: at rims and fronts",
        low=0.0,
        high=0.003,
    )
    frequency: float = setting(
        8.0,
        "Frequency",
        "Waves per second (Hz) that leave the fronts. The wavelength is speed over frequency",
        low=1.0,
        high=10.0,
    )
    speed: float = setting(
        0.15,
        "Speed",
        "Speed (m/s) of the waves on the surface. The wavelength is speed over frequency",
        low=0.1,
        high=1.0,
    )
    damping: float = setting(
        0.9,
        "Damping",
        "Share of its motion that a wave keeps after 1/60 s: 1 never fades, less fades sooner",
        low=0.5,
        high=1.0,
    )
    reach: float = setting(
        0.08,
        "Travel (m)",
        "How far in metres waves travel from the fronts",
        low=0.0,
        high=0.4,
    )

    @property
    def wavelength(self) -> float:
        """Metres from crest to crest."""
        return self.speed / self.frequency


@dataclass(frozen=True)
class SheetSettings(RefinementSettings):
    """The settings of sheets: films with rims instead of the slabs that a grid can hold."""

    label: ClassVar[str] = "Sheets"
    about: ClassVar[str] = "Thin films with rims at their edges, beads and fingers"

    film: float = setting(
        1.0, "Film (mm)",
        "Thickness of sheets in millimetres at real size, where the flow has not stretched them",
        low=0.0, high=10_000.0, soft=3.0,
    )  # fmt: skip
    stretch: float = setting(
        0.5, "Stretch", "How much thinner sheets are where the flow has drawn them apart",
        low=0.0, high=1.0,
    )  # fmt: skip
    rims: float = setting(
        1.0, "Rims",
        "Thickness of the rims at free edges, over that of a rim that surface tension has "
        "gathered during the liquid's flight",
        low=0.0, high=4.0,
    )  # fmt: skip
    beads: float = setting(
        0.4, "Beads", "How much rims swell and narrow, with a wavelength of nine radii",
        low=0.0, high=1.0,
    )  # fmt: skip
    spacing: float = setting(
        9.0, "Spacing",
        "Distance of beads over the radius of their rim: 9 in water (Rayleigh-Plateau), more in "
        "viscous liquids",
        low=4.0, high=100.0, soft=30.0,
    )  # fmt: skip
    fingers: float = setting(
        0.5, "Fingers", "Length of the fingers that grow from beads along the outward flow",
        low=0.0, high=2.0, soft=1.0,
    )  # fmt: skip
    drops: float = setting(
        0.5, "Drops", "How many drops the fingers have shed", low=0.0, high=2.0, soft=1.0,
    )  # fmt: skip
    holes: float = setting(
        0.0, "Holes", "How many holes have opened in the oldest, thinnest film",
        low=0.0, high=1.0,
    )  # fmt: skip
    fairing: float = setting(
        1.0, "Fairing", "How far sheets are smoothed, both sides together: by half a voxel at most",
        low=0.0, high=1.0,
    )  # fmt: skip
    seed: int = setting(
        0,
        "Seed",
        "Number that picks one of the possible sets of beads, fingers, drops and holes",
        low=0,
        high=2**31 - 1,
    )


@dataclass(frozen=True)
class CleanupSettings(RefinementSettings):
    """The settings of cleaning up."""

    label: ClassVar[str] = "Clean Up"
    about: ClassVar[str] = "Remove specks of liquid"

    volume: float = setting(
        30.0,
        "Least Volume",
        "Pieces of liquid smaller than this are removed, in voxels of the splash",
        low=1.0,
        high=10_000.0,
    )


KINDS: dict[str, type[RefinementSettings]] = {
    "DROPLETS": DropletSettings,
    "RUPTURES": RuptureSettings,
    "SHEETS": SheetSettings,
    "WAVES": WaveSettings,
    "CLEANUP": CleanupSettings,
}
"""All kinds of refinement by identifier."""
