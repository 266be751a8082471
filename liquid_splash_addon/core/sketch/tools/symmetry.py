# SPDX-License-Identifier: GPL-3.0-or-later
"""Tools of symmetry: Spin turns strokes around an axis, Mirror reflects them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from ...settings import LATENT_SEED_MAX, setting
from ..drawing import Drawing
from ..presets.pen import HASTE, SHORTER, random_waves, swayed
from .tool import (
    FLAT,
    Derived,
    Place,
    StrokeTool,
    axis_setting,
    hastened,
    moved_to,
    places_along,
    sampled_at,
    shares_along,
    size_of,
)

STRAY = 0.25
"""Share of the angle between neighbours that variation 1 turns a stroke by, at most."""


class Copy(NamedTuple):
    """How one stroke around the axis differs from its profile.

    Attributes
    ----------
    angle : radians that it is turned by; length : share of the profile that it has; haste : its
    speed over the profile's; sway : amount of the waves, see :func:`..presets.pen.swayed`
    """

    angle: float
    length: float
    haste: float
    sway: float


@dataclass(frozen=True)
class Spin(StrokeTool):
    """One profile or a few become strokes around an axis."""

    label: ClassVar[str] = "Spin"
    about: ClassVar[str] = (
        "Make strokes around an axis from one profile, or from a few that take turns: a crown out "
        "of one stroke"
    )

    axis: str = axis_setting("Z", "Axis that the strokes are turned around")
    count: int = setting(12, "Strokes", "Strokes around the axis, in all", low=2, high=64, soft=32)
    angle: float = setting(
        360.0, "Angle", "Degrees around the axis that they cover", low=-360.0, high=360.0
    )
    radius: float = setting(
        0.0, "Radius", "Distance that profiles are moved away from the axis, in Blender units",
        low=0.0, high=1000.0, soft=2.0,
    )  # fmt: skip
    dip: float = setting(
        0.25, "Dip", "Share of its length that every second stroke is shorter: points of a crown, "
        "and dips between them. Only of a single profile: several bring points of their own",
        low=0.0, high=0.9,
    )  # fmt: skip
    lean: float = setting(
        0.2, "Lean", "How far neighbours lean to each other in pairs, share of the angle between "
        "them: liquid gathers in the points. Only of a single profile", low=0.0, high=0.5,
    )  # fmt: skip
    swirl: float = setting(
        0.0, "Swirl", "Degrees that strokes turn around the axis on their way",
        low=-360.0, high=360.0, soft=180.0,
    )  # fmt: skip
    variation: float = setting(
        0.25, "Variation", "How much strokes differ in length, speed and place, as if by hand. The "
        "first stays as it was drawn", low=0.0, high=1.0,
    )  # fmt: skip
    seed: int = setting(0, "Seed", "Which of all possible variations", low=0, high=LATENT_SEED_MAX)

    def apply(self, strokes: Sequence[Drawing], place: Place) -> list[Derived]:
        """Return ``count`` strokes; profiles take turns, each turned to its place."""
        basis = np.roll(place.axes, -1 - "XYZ".index(self.axis), axis=0)  # the axis comes last
        profiles = [(stroke.points - place.pivot) @ basis.T for stroke in strokes]
        bearings = [bearing_of(profile) for profile in profiles]
        rng = np.random.default_rng(self.seed)
        waves = random_waves(rng, self.extent(profiles))
        made = []
        for number, copy in enumerate(self.copies(len(strokes), rng)):
            source = number % len(strokes)
            places = places_along(profiles[source], copy.length * shares_along(profiles[source]))
            turned = self.turned(
                sampled_at(Drawing(profiles[source]), places).points,
                bearings[source],
                copy.angle + bearings[0] - bearings[source],
            )
            if copy.sway:
                turned = swayed(turned, copy.sway, waves)
            drawing = moved_to(sampled_at(strokes[source], places), turned @ basis + place.pivot)
            made.append(Derived(hastened(drawing, copy.haste), source, places))
        return made

    def copies(self, profiles: int, rng: np.random.Generator) -> list[Copy]:
        """Return how each stroke differs from its profile; the first not at all.

        Profiles that take turns differ already: with dips and pairs on top of that, neighbours
        would be so far apart that no sheet spans them.
        """
        dip, lean = (self.dip, self.lean) if profiles == 1 else (0.0, 0.0)
        is_closed = abs(self.angle) == 360.0
        step = np.radians(self.angle) / (self.count if is_closed else self.count - 1)
        shorter, haste, stray = rng.uniform(-1, 1, (3, self.count)) * self.variation
        found = []
        for n in range(self.count):
            angle = n * step
            if n > 0:
                # The first of each pair leans forward, its neighbour back; by the difference
                # between both, as the first stays where it was drawn.
                angle += lean * step * ((-1) ** n - 1) + STRAY * step * stray[n]
            length = 1 - dip * (n % 2)
            if n > 0:
                length *= 1 - SHORTER * abs(shorter[n]) ** 2 / max(self.variation, 1e-9)
            found.append(
                Copy(angle, length, 1 + HASTE * haste[n] * (n > 0), self.variation * (n > 0))
            )
        return found

    def turned(self, profile: np.ndarray, bearing: float, angle: float) -> np.ndarray:
        """Return a profile ``(n, 3)``, about the last axis, moved out, swirled and turned.

        bearing : angle at which it stands; angle : that it is turned by, both in radians
        """
        out = profile + self.radius * np.array([np.cos(bearing), np.sin(bearing), 0.0])
        angles = angle + np.radians(self.swirl) * shares_along(out)
        cosine, sine = np.cos(angles), np.sin(angles)
        x, y, z = out.T
        return np.stack([cosine * x - sine * y, sine * x + cosine * y, z], axis=1)

    def extent(self, profiles: Sequence[np.ndarray]) -> float:
        """Return the longest side of what is made: across the axis or along it."""
        together = np.concatenate(profiles)
        radius = np.hypot(together[:, 0], together[:, 1]).max() + self.radius
        return max(2 * float(radius), float(np.ptp(together[:, 2])), 1e-9)


def bearing_of(profile: np.ndarray) -> float:
    """Return the angle about the last axis at which a profile ``(n, 3)`` is farthest from it."""
    farthest = profile[np.argmax(np.hypot(profile[:, 0], profile[:, 1]))]
    return float(np.arctan2(farthest[1], farthest[0]))


@dataclass(frozen=True)
class Mirror(StrokeTool):
    """The mirror images of strokes."""

    label: ClassVar[str] = "Mirror"
    about: ClassVar[str] = "Add the mirror images of strokes, or replace strokes by them"

    axis: str = axis_setting("X", "Axis across the mirror, which goes through the pivot")
    keep: bool = setting(
        True, "Keep Strokes", "Add the mirror images. Strokes in the mirror itself get none",
        low=False, high=True,
    )  # fmt: skip

    @property
    def keeps_strokes(self) -> bool:
        """Whether the mirror images are added."""
        return self.keep

    def apply(self, strokes: Sequence[Drawing], place: Place) -> list[Derived]:
        """Return the mirror images."""
        across = place.axes["XYZ".index(self.axis)]
        made = []
        for number, stroke in enumerate(strokes):
            before = (stroke.points - place.pivot) @ across
            if self.keep and np.abs(before).max() <= FLAT * size_of([stroke]):
                continue
            points = stroke.points - 2 * before[:, None] * across
            places = np.arange(len(points), dtype=np.float64)
            made.append(Derived(moved_to(stroke, points), number, places))
        return made
