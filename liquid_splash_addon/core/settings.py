# SPDX-License-Identifier: GPL-3.0-or-later
"""The one list of parameters; Blender's properties are made from it."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from .liquids import ITEMS as LIQUID_ITEMS

LATENT_SEED_MAX = 2**31 - 1


def setting(default: Any, label: str, description: str, **limits: Any) -> Any:
    """Return a dataclass field that also carries what an interface shows.

    limits : ``low`` and ``high``, or ``items`` of (identifier, label, description); ``soft``, the
    end of a slider where that is below ``high``.
    """
    return field(default=default, metadata={"label": label, "description": description, **limits})


@dataclass(frozen=True)
class Settings:
    """A list of parameters; ValueError where one is outside its limits."""

    def __post_init__(self) -> None:
        for item in fields(self):
            check_setting(item.name, getattr(self, item.name), item.metadata)


@dataclass(frozen=True)
class SplashSettings(Settings):
    """What a user chooses for one splash. Units are in each description."""

    real_size: float = setting(
        0.33,
        "Real Size (m)",
        "Longest side of the sketch in the real world, in metres, from a thimble to a harbour "
        "wave (0: one unit is one metre). Larger splashes have thinner sheets and smaller drops "
        "for their size, and move more slowly",
        low=0.0,
        high=1000.0,
        soft=1.0,
    )
    speed_source: str = setting(
        "TIME",
        "Speed",
        "Where the speed of the strokes comes from",
        items=(
            ("TIME", "Recorded Time", "The time at which each point was drawn"),
            (
                "PRESSURE",
                "Pressure",
                "Pen pressure, or the radius of a curve, times the stroke speed",
            ),
            (
                "ATTRIBUTE",
                "Attribute",
                "The attribute 'speed' of each point, in units per second; where there is none, "
                "the recorded time",
            ),
            ("CONSTANT", "Constant", "The stroke speed"),
        ),
    )
    stroke_speed: float = setting(
        0.67,
        "Stroke Speed",
        "Speed of the hand in m/s at real size: for constant speed, at full pressure, and for "
        "strokes without recorded time",
        low=0.01,
        high=10.0,
    )
    speed_gain: float = setting(
        3.0,
        "Speed Gain",
        "Liquid speed over hand speed. Hands draw at about a third of the speed of splashes; Fit "
        "Speed sets it to suit a sketch",
        low=0.1,
        high=20.0,
    )
    use_modifiers: bool = setting(
        False,
        "Modifiers",
        "Read the strokes as the modifiers of the sketch leave them. Those that move points away "
        "from where they were drawn change speeds with them",
        low=False,
        high=True,
    )
    seed: int = setting(
        0, "Seed", "Number that picks one of the possible splashes", low=0, high=LATENT_SEED_MAX
    )
    variation: float = setting(
        0.0,
        "Variation",
        "How far the splash may stray from the most likely one (0: the same for every seed)",
        low=0.0,
        high=1.0,
    )
    resolution: str = setting(
        "128",
        "Resolution",
        "Voxels along each side of the space that a splash is made in",
        items=(
            ("64", "64 (Preview)", "Fast, to see where the liquid goes"),
            ("128", "128", "The result"),
        ),
    )
    surface_threshold: float = setting(
        0.5,
        "Thinness",
        "How sure it must be that there is liquid: lower is fuller, higher is thinner",
        low=0.05,
        high=0.95,
    )
    reach: float = setting(
        0.0,
        "Keep Near (m)",
        "Farthest that liquid may be from a stroke, in metres at real size (0: no bound). "
        "About 0.01 keeps letters and figures of a few strokes from being filled by sheets",
        low=0.0,
        high=0.4,
        soft=0.1,
    )
    breakup: float = setting(
        1.0,
        "Breakup",
        "Surface tension over that of water: the more, and the slower the liquid flows, the sooner "
        "what is thin parts into strands and drops (0: never)",
        low=0.0,
        high=10.0,
        soft=4.0,
    )
    liquid: str = setting(
        "WATER",
        "Liquid",
        "What flows: its surface tension and viscosity decide how soon Breakup parts it, and what "
        "droplets, ruptures, sheets and waves make of it",
        items=LIQUID_ITEMS,
    )
    divergence_free: bool = setting(
        False,
        "Divergence-Free",
        "Remove the part of the velocity that would change the liquid's volume, as a solver's "
        "first step does. The shape stays",
        low=False,
        high=True,
    )
    device: str = setting(
        "AUTO",
        "Device",
        "What computes the splash",
        items=(
            ("AUTO", "Automatic", "The GPU if torch can use one, else the processor"),
            ("CPU", "CPU", "The processor"),
            ("CUDA", "CUDA", "An NVIDIA or AMD GPU"),
            ("MPS", "Metal", "An Apple GPU"),
        ),
    )

    def __repr__(self) -> str:
        """Show all but what is water's: so splashes of older files are still known by it."""
        shown = [item for item in fields(self) if item.name != "liquid" or self.liquid != "WATER"]
        inside = ", ".join(f"{item.name}={getattr(self, item.name)!r}" for item in shown)
        return f"{type(self).__name__}({inside})"

    @property
    def seed_of_details(self) -> int:
        """What the seeds of refinements follow: 0 without variation, where all seeds are alike."""
        return self.seed if self.variation > 0 else 0

    @property
    def cells(self) -> int:
        """Cells along each side of the local grid."""
        return int(self.resolution)


def check_setting(name: str, value: Any, limits: Any) -> None:
    """Raise ValueError if ``value`` is outside the limits of the setting ``name``."""
    if "items" in limits:
        known = [identifier for identifier, _, _ in limits["items"]]
        if value not in known:
            raise ValueError(f"{name} must be one of {', '.join(known)}, not {value!r}")
    elif not limits["low"] <= value <= limits["high"]:
        raise ValueError(f"{name} must be from {limits['low']} to {limits['high']}, not {value}")


@dataclass(frozen=True)
class MotionSettings(Settings):
    """How fast a splash or model moves in the scene. The liquid itself does not depend on it."""

    time_scale: float = setting(
        0.05,
        "Time Scale",
        "Speed of the liquid in the scene over its real speed: 0.05 is what a high-speed camera "
        "would show, 1 is real time, in which a splash is a blur",
        low=0.001,
        high=10.0,
        soft=1.0,
    )
    gravity: float = setting(
        1.0,
        "Gravity",
        "Gravity of the ballistic preview, over the Earth's at the splash's size and speed "
        "(0: drops fly straight on)",
        low=-10.0,
        high=10.0,
    )
    shape_frame: int = setting(
        1,
        "Shape Frame",
        "Frame at which the splash has the drawn shape: before it flows together, after it apart",
        low=-(2**20),
        high=2**20,
    )

    @property
    def speed_label(self) -> str:
        """The time scale in words."""
        if self.time_scale == 1:
            return "Real speed"
        if self.time_scale > 1:
            return f"{self.time_scale:.3g} times real speed"
        return f"1/{1 / self.time_scale:.3g} speed"


@dataclass(frozen=True)
class ModelSettings(Settings):
    """How the splashes of a model are joined. Mirrors and axis are the model's own."""

    blend: float = setting(
        2.0,
        "Blend",
        "Width of the smooth joint between splashes, in voxels of the finest: 0 for a sharp one",
        low=0.0,
        high=8.0,
    )
    mirror_x: bool = setting(
        False, "X", "Add the mirror image along the model's X axis", low=False, high=True
    )
    mirror_y: bool = setting(
        False, "Y", "Add the mirror image along the model's Y axis", low=False, high=True
    )
    mirror_z: bool = setting(
        False, "Z", "Add the mirror image along the model's Z axis", low=False, high=True
    )
    count: int = setting(
        1, "Radial Count", "Copies around the model's axis, the first included", low=1, high=32
    )
    axis: str = setting(
        "Z",
        "Radial Axis",
        "Axis of the model around which the copies stand",
        items=tuple((name, name, f"The model's {name} axis") for name in "XYZ"),
    )

    @property
    def mirrors(self) -> tuple[bool, bool, bool]:
        """Along which axes it is mirrored."""
        return self.mirror_x, self.mirror_y, self.mirror_z
