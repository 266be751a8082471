# SPDX-License-Identifier: GPL-3.0-or-later
"""Preset sketches of streams: streamlet, bottle pour and collision.

Strokes lie side by side in ribbons: liquid of them is a film with two rims, as poured and thrown
liquid is. Strokes that lie in rings around a line make a rope of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...settings import setting
from .pen import LONG, Paths, SketchPreset, jagged, shares, shortened, size_setting, strokes_setting
from .rings import around

Y = np.array([0.0, 1.0, 0.0])


def ribbon(
    centre: np.ndarray,
    width: np.ndarray,
    count: int,
    turns: tuple[float, float] = (0.0, 0.0),
    cup: float = 0.0,
    jags: float = 0.0,
) -> list[np.ndarray]:
    """Return ``count`` paths ``(n, 3)`` side by side in a ribbon along ``centre`` ``(n, 3)``.

    The first is the centre, if ``count`` is odd. width : of the ribbon at each point, ``(n,)``;
    turns : whole turns of the ribbon around its centre at its start and at its end, where 0 lies
    across the centre in the xz plane; cup : how far its sides are bent up, over its width;
    jags : share by which every second path is shorter, see :func:`jagged`.
    """
    along = np.gradient(centre, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, Y)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
    up = np.cross(side, along)
    angle = 2 * np.pi * np.linspace(*turns, len(centre))[:, None]
    across = np.cos(angle) * side + np.sin(angle) * up
    above = np.cos(angle) * up - np.sin(angle) * side
    places = np.linspace(-0.5, 0.5, count)
    paths = [
        centre + width[:, None] * (place * across + 4 * cup * place**2 * above) for place in places
    ]
    paths = jagged(paths, jags)
    return [paths[n] for n in np.argsort(np.abs(places), kind="stable")]


@dataclass(frozen=True)
class Streamlet(SketchPreset):
    """A streamlet: liquid thrown through the air."""

    label: ClassVar[str] = "Streamlet"
    about: ClassVar[str] = "A ribbon of liquid thrown through the air in an arc, broad in front"

    length: float = size_setting(2.0, "Length", "Distance that the stream covers")
    height: float = size_setting(0.6, "Height", "Height of the arc above its ends", low=0.0)
    thickness: float = size_setting(
        0.7, "Thickness", "Width of the stream at its front", low=0.05, high=1.5
    )
    twist: float = setting(
        0.3, "Twist", "Turns of the ribbon around its middle on its way", low=-2.0, high=2.0
    )
    jags: float = setting(
        0.16, "Jags", "How far the front dips between strokes: share of the length",
        low=0.0, high=0.5,
    )  # fmt: skip
    strokes: int = strokes_setting(7)

    def paths(self) -> Paths:
        """Return strokes along +x: a thin tail, then a ribbon that widens to its front."""
        share = shares(LONG)
        centre = np.stack(
            [self.length * (share - 0.5), 0 * share, 4 * self.height * share * (1 - share)], axis=1
        )
        width = self.thickness * (0.12 + 0.88 * share**1.4)
        turns = (0.25 - self.twist, 0.25)  # flat in front, as liquid from a cup flies
        return {"Streamlet": ribbon(centre, width, self.strokes, turns, 0.15, self.jags)}


@dataclass(frozen=True)
class BottlePour(SketchPreset):
    """A stream that winds around a bottle."""

    label: ClassVar[str] = "Bottle Pour"
    about: ClassVar[str] = (
        "A stream that winds down around a bottle and flies off: put the bottle into the middle "
        "and choose it as obstacle"
    )

    width: float = size_setting(2.0, "Width", "Diameter of the loop where the stream flies off")
    height: float = size_setting(1.55, "Height", "Height from which the stream winds down", low=0.2)
    bottle: float = size_setting(
        0.56, "Bottle", "Diameter of the bottle that the stream winds around", low=0.1, high=0.9
    )
    turns: float = setting(1.15, "Turns", "Turns around the bottle", low=0.5, high=2.0)
    band: float = size_setting(
        0.55, "Band", "Height of the stream where it is broadest", low=0.1, high=1.0
    )
    jags: float = setting(
        0.12, "Jags", "How far the front dips between strokes: share of the length",
        low=0.0, high=0.5,
    )  # fmt: skip
    strokes: int = strokes_setting(9)

    def paths(self) -> Paths:
        """Return strokes above each other around the z axis, from the top down and outwards."""
        share = shares(LONG)
        angle = 2 * np.pi * self.turns * (share - 1)
        close = 0.62 * self.bottle
        off = np.clip((share - 0.45) / 0.55, 0, 1) ** 1.7
        radius = close + (self.width / 2 - close) * off
        band = self.band * (0.2 + 0.8 * share)
        paths = []
        for place in np.linspace(-0.5, 0.5, self.strokes):
            low = self.height * (1 - share) ** 1.1 + band * (0.5 + place)
            # Bent like a gutter: the sides fly off farther than the middle.
            gutter = radius * (1 - 0.25 * off * (1 - 4 * place**2))
            paths.append(around(angle, gutter, low))
        return {"Bottle Pour": jagged(paths, self.jags)}


@dataclass(frozen=True)
class Collision(SketchPreset):
    """Two streams that meet and make a sheet between them."""

    label: ClassVar[str] = "Collision"
    about: ClassVar[str] = "Two streams that meet head on and make a sheet between them"

    length: float = size_setting(2.0, "Length", "Distance between the ends of the streams")
    height: float = size_setting(1.7, "Height", "Diameter of the sheet")
    stream: float = size_setting(
        0.14, "Stream", "Diameter of the streams where they come from", low=0.05, high=0.4
    )
    flap: float = setting(
        0.12, "Flap", "How far the sheet's edge swings to both sides: share of its diameter",
        low=0.0, high=0.5,
    )  # fmt: skip
    jags: float = setting(
        0.16, "Jags", "How far the sheet's edge dips between strokes: share of their length",
        low=0.0, high=0.6,
    )  # fmt: skip
    strokes: int = setting(
        10, "Strokes", "Strokes of each stream: more of them make fuller and smoother liquid",
        low=5, high=10,
    )  # fmt: skip

    def paths(self) -> Paths:
        """Return strokes along +-x to the middle, and from there outwards to all sides."""
        share = shares(LONG)
        out = np.clip((share - 0.42) / 0.58, 0, 1)
        thin = 1 - 0.5 * np.clip(share / 0.42, 0, 1)
        radius = self.stream / 2 * thin + (self.height / 2 - self.stream / 4) * out**1.15
        inwards = self.length / 2 * np.clip(1 - share / 0.5, 0, 1) ** 1.25
        paths = []
        for n in range(self.strokes):
            for side in (-1, 1):
                # Strokes of both streams in turn, so that the sheet is of both.
                angle = 2 * np.pi * (n + 0.25 + 0.25 * side) / self.strokes
                # The edge swings to the one side and to the other, as of a sheet that flaps.
                flap = self.flap * self.height / 2 * np.sin(2 * angle) * out**2
                x = side * (inwards + 0.012) + flap
                path = np.stack([x, radius * np.cos(angle), radius * np.sin(angle)], axis=1)
                paths.append(shortened(path, 1 - self.jags * (side > 0)))
        return {"Collision": paths}
