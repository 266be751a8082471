# SPDX-License-Identifier: GPL-3.0-or-later
"""Preset sketches of what liquid does by itself: jet, sheet and wave."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...settings import setting
from .pen import Paths, SketchPreset, jagged, shares, shortened, size_setting, strokes_setting
from .rings import around


@dataclass(frozen=True)
class Jet(SketchPreset):
    """A jet: liquid that comes down and spreads over a point."""

    label: ClassVar[str] = "Jet"
    about: ClassVar[str] = "A jet that comes down and spreads where it hits"

    width: float = size_setting(2.06, "Width", "Diameter of the spread liquid")
    height: float = size_setting(0.9, "Height", "Height from which the jet comes", low=0.2)
    lift: float = setting(
        0.12, "Lift", "How high the liquid springs off again, in Blender units", low=0.0, high=1.0
    )
    column: float = setting(
        0.08, "Column", "Diameter of the jet where it lands, in Blender units", low=0.02, high=0.4
    )
    rim: float = setting(
        0.4, "Rim", "How high the edge of the spread liquid rises, in Blender units",
        low=0.0, high=0.8,
    )  # fmt: skip
    jags: float = setting(
        0.12, "Jags", "How far the edge dips between strokes: share of their length",
        low=0.0, high=0.5,
    )  # fmt: skip
    bow: float = setting(
        0.3, "Bow", "How far from the side the jet comes, as out of a jug, in Blender units",
        low=0.0, high=1.0,
    )  # fmt: skip
    strokes: int = strokes_setting(16)

    def paths(self) -> Paths:
        """Return strokes down the axis and out to all sides."""
        share = shares()
        bend = np.clip((share - 0.35) / 0.65, 0, 1)
        thin = 0.08 - (0.08 - self.column / 2) * np.minimum(share / 0.35, 1.0)
        radius = thin + (self.width / 2 - thin) * bend**1.2
        fall = np.minimum(share / 0.4, 1.0) ** 1.2
        height = self.height - (self.height + 0.1) * fall + self.lift * np.sin(bend * np.pi)
        height = height + self.rim * bend**3
        # A parabola that ends upright, of a stream that swells and narrows on its way.
        left = np.clip(1 - share / 0.35, 0, 1)
        aside = np.outer(self.bow * left**2, [-0.8, 0.6, 0.0])
        swell = min(self.bow, 0.3) * 0.83
        radius = radius * (1 + swell * np.sin(9 * left) * left * (1 - left) * 4)
        angles = 2 * np.pi * np.arange(self.strokes) / self.strokes
        lengths = 1 - self.jags * (np.arange(self.strokes) % 2)
        return {
            "Jet": [
                shortened(around(angle, radius, height) + aside, length)
                for angle, length in zip(angles, lengths, strict=True)
            ]
        }


@dataclass(frozen=True)
class Sheet(SketchPreset):
    """A sheet: liquid thrown from a cup, a fan that gets broader and thinner."""

    label: ClassVar[str] = "Sheet"
    about: ClassVar[str] = "A fan of liquid thrown from a cup, broader and thinner to its front"

    length: float = size_setting(2.0, "Length", "Distance from the source to the front")
    width: float = size_setting(1.6, "Width", "Width of the front")
    height: float = size_setting(0.9, "Height", "Height of the front above the source", low=0.0)
    source: float = size_setting(0.3, "Source", "Width of the source", low=0.05)
    cup: float = setting(
        0.2, "Cup", "How far the sides are bent up, over the width: 0 for a flat sheet",
        low=-0.5, high=0.5,
    )  # fmt: skip
    jags: float = setting(
        0.15, "Jags", "How far the front dips between strokes: share of the length",
        low=0.0, high=0.5,
    )  # fmt: skip
    strokes: int = strokes_setting(9)

    def paths(self) -> Paths:
        """Return strokes from the source at the origin along +x, side by side."""
        share = shares()
        paths = []
        for across in np.linspace(-0.5, 0.5, self.strokes):
            broad = self.source + (self.width - self.source) * share**1.2
            # An arc in front, its middle ahead of its sides.
            x = self.length * share * (1 - 0.6 * across**2 * share)
            z = self.height * np.sin(share * np.pi / 2) + 4 * self.cup * across**2 * broad
            paths.append(np.stack([x, across * broad, z], axis=1))
        return {"Sheet": jagged(paths, self.jags)}


@dataclass(frozen=True)
class Wave(SketchPreset):
    """A wave: a sheet that curls over."""

    label: ClassVar[str] = "Wave"
    about: ClassVar[str] = "A sheet that curls over like a breaking wave"

    length: float = size_setting(
        2.0, "Length", "Length of the whole arch, of which the curl is a part"
    )
    height: float = size_setting(0.85124, "Height", "Height of the crest", low=0.1)
    width: float = size_setting(1.2, "Width", "Width of the front, along the crest", low=0.2)
    curl: float = setting(
        198.0, "Curl", "Degrees around which the front has come", low=90.0, high=330.0
    )
    jags: float = setting(
        0.14, "Jags", "How far the front dips between strokes: share of their length",
        low=0.0, high=0.5,
    )  # fmt: skip
    rounding: float = setting(
        0.22, "Rounding", "How far the sides stay behind the middle: share of the length",
        low=0.0, high=0.6,
    )  # fmt: skip
    strokes: int = strokes_setting(9)

    def paths(self) -> Paths:
        """Return strokes from the foot up and over along +x, from one side to the other."""
        share = shares()
        angle = np.radians(9.0 + (self.curl - 9.0) * share)
        radius = 1.0 - 0.25 * share
        # The crest of the middle stroke is at ``height``.
        tall = self.height / (radius * np.sin(angle)).max()
        paths = []
        for across in np.linspace(-0.5, 0.5, self.strokes):
            x = -self.length / 2 * radius * np.cos(angle)
            z = tall * radius * np.sin(angle) * (0.85 + 0.1 * np.cos(1.6 * across)) / 0.95
            y = across * (1 + 0.5 * share)
            paths.append(np.stack([x, y, z], axis=1))
        paths = jagged(paths, self.jags, self.rounding)
        wide = self.width / max(2 * np.abs(path[:, 1]).max() for path in paths)
        return {"Wave": [path * [1.0, wide, 1.0] for path in paths]}
