# SPDX-License-Identifier: GPL-3.0-or-later
"""Preset sketches around an axis: crown and skirt."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...settings import setting
from .pen import Paths, SketchPreset, shares, size_setting


def around(angle: np.ndarray, radius: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Return a path ``(n, 3)`` from cylindrical coordinates, ``(n,)`` each."""
    angle, radius, height = np.broadcast_arrays(angle, radius, height)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)


@dataclass(frozen=True)
class Crown(SketchPreset):
    """A crown: liquid thrown up and outwards from a ring."""

    label: ClassVar[str] = "Crown"
    about: ClassVar[str] = "Liquid thrown up and outwards from a ring, as by a falling drop"

    width: float = size_setting(2.0, "Width", "Diameter of the rim")
    height: float = size_setting(0.87, "Height", "Height of the points", low=0.1)
    points: int = setting(6, "Points", "Points of the crown, of two strokes each", low=3, high=10)
    jags: float = setting(
        0.276, "Jags", "How far the rim dips between two points: share of the height",
        low=0.0, high=0.7,
    )  # fmt: skip
    base: float = setting(
        0.35, "Base", "Diameter at the foot over that of the rim",
        low=0.1, high=0.8,
    )  # fmt: skip

    def paths(self) -> Paths:
        """Return a tall stroke to each point and a lower one beside it."""
        share = shares()
        strokes = []
        for n in range(2 * self.points):
            # Drawn in pairs that lean to each other: liquid gathers in the points.
            angle = np.pi * n / self.points + 0.6 / self.points * (-1) ** n
            height = self.height * (1 - self.jags * (n % 2))
            radius = self.width / 2 * (self.base + (1 - self.base) * share**1.3)
            strokes.append(around(angle, radius, height * np.sin(share * np.pi / 2)))
        return {"Crown": strokes}


@dataclass(frozen=True)
class Skirt(SketchPreset):
    """A skirt: liquid whirled outwards and down from a waist."""

    label: ClassVar[str] = "Skirt"
    about: ClassVar[str] = "Liquid whirled outwards and down from a waist, for a dancing figure"

    width: float = size_setting(2.0, "Width", "Diameter of the hem")
    height: float = size_setting(0.9, "Height", "Height from the waist to the hem", low=0.1)
    waist: float = size_setting(0.6, "Waist", "Diameter of the waist", low=0.1)
    folds: int = setting(5, "Folds", "Folds around the hem", low=0, high=8)
    depth: float = setting(
        0.5, "Fold Depth", "How far the hem swings up between folds: share of the height",
        low=0.0, high=1.0,
    )  # fmt: skip
    swirl: float = setting(
        50.0, "Swirl", "Degrees that the strokes turn around the axis on their way",
        low=-180.0, high=180.0,
    )  # fmt: skip

    def paths(self) -> Paths:
        """Return the strokes from the waist at z = 0 down to the hem, as many to each fold."""
        share = shares()
        strokes = []
        for first in 2 * np.pi * np.arange(self.strokes) / self.strokes:
            rise = self.depth * (1 - np.cos(self.folds * first)) / 2
            angle = first + np.radians(self.swirl) * share
            radius = (self.waist + (self.width - self.waist) * share**1.5) / 2
            # Down along the body first, then whirled outwards.
            fall = np.sin(share * np.pi / 2) - rise * share**2
            strokes.append(around(angle, radius, -self.height * fall))
        return {"Skirt": strokes}

    @property
    def strokes(self) -> int:
        """Number of strokes: 12 to 20, as many to each fold, so that all folds are alike."""
        if self.folds == 0:
            return 16
        return self.folds * max(-(-12 // self.folds), min(4, 20 // self.folds))
