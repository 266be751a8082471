# SPDX-License-Identifier: GPL-3.0-or-later
"""Preset sketches of figures: heart, butterfly and letter S. They stand in the xz plane.

So they face Blender's front view. Where a figure is made of several splashes, as in the paper's
Figs. 1 and 13, each is a layer.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...settings import setting
from .pen import LONG, Paths, SketchPreset, shares, shortened, size_setting, strokes_setting
from .ribbons import ribbon


@dataclass(frozen=True)
class Heart(SketchPreset):
    """A heart of liquid that is poured into its cleft."""

    label: ClassVar[str] = "Heart"
    about: ClassVar[str] = "A heart, and the streamlet that is poured into it"

    width: float = size_setting(2.0, "Width", "Width of the heart")
    height: float = size_setting(1.8, "Height", "Height of the heart")
    pour: float = setting(
        1.0, "Pour", "Height from which the streamlet comes, in Blender units: 0 for none",
        low=0.0, high=3.0,
    )  # fmt: skip
    thickness: float = size_setting(
        0.45, "Thickness", "Width of the ribbon that the line is", low=0.1, high=0.8
    )
    tilt: float = setting(
        0.12, "Tilt", "Turns of the ribbon out of the heart's plane, towards the front",
        low=-0.25, high=0.25,
    )  # fmt: skip
    strokes: int = setting(
        6, "Strokes", "Strokes of each half: more of them make fuller and smoother liquid",
        low=4, high=10,
    )  # fmt: skip

    def paths(self) -> Paths:
        """Return the heart, from its cleft over both sides to the tip, and the streamlet."""
        outline = self.outline()
        # Narrower where the halves meet, so that cleft and tip stay sharp.
        width = self.thickness * (0.25 + 0.75 * np.sin(np.pi * shares(LONG)) ** 0.7)
        halves = ribbon(outline, width, self.strokes, (self.tilt, self.tilt), 0.2)
        halves = fitted(halves, self.width, self.height)
        mirrored = [half * [-1, 1, 1] for half in halves]
        layers = {"Heart": [half for pair in zip(halves, mirrored, strict=True) for half in pair]}
        if self.pour > 0:
            layers["Streamlet"] = self.streamlet(halves[0][0])
        return layers

    def outline(self) -> np.ndarray:
        """Return the right half of the outline ``(LONG, 3)``, its middle at the origin."""
        # Slow near the cleft, where the curve turns sharply.
        t = np.pi * shares(LONG) ** 0.9
        x = np.sin(t) ** 3
        z = 13 * np.cos(t) - 5 * np.cos(2 * t) - 2 * np.cos(3 * t) - np.cos(4 * t)
        z = (z - z.min()) / np.ptp(z) - 0.5
        return np.stack([self.width / 2 * x, 0 * t, self.height * z], axis=1)

    def streamlet(self, cleft: np.ndarray) -> list[np.ndarray]:
        """Return strokes that fall to the ``cleft`` ``(3,)`` from its left."""
        share = shares()
        centre = np.stack(
            [-0.5 * self.pour * (1 - share) ** 1.5, 0 * share, self.pour * (1 - share**1.5)],
            axis=1,
        )
        width = 0.6 * self.thickness * (1 - 0.6 * share)
        return ribbon(cleft + centre, width, 6, (0.0, 0.4))


FORE_RIM = np.array([(0.95, 0.14), (0.98, 0.36), (1.0, 0.6), (1.0, 0.84), (0.88, 1.0), (0.6, 1.0)])
HIND_RIM = np.array(
    [(0.76, -0.2), (0.84, -0.4), (0.8, -0.66), (0.62, -0.88), (0.4, -0.98), (0.16, -0.86)]
)
"""Corners of the right wings' rims, from the notch between them outwards: x and z, of 1."""

FORE_ROOTS = np.array([(0.03, 0.02), (0.03, 0.2)])
HIND_ROOTS = np.array([(0.03, -0.02), (0.03, -0.2)])
"""Where the first and the last vein leave the body."""


@dataclass(frozen=True)
class Butterfly(SketchPreset):
    """A butterfly: wings that are splashes from the body outwards."""

    label: ClassVar[str] = "Butterfly"
    about: ClassVar[str] = "A butterfly, each of its wings a splash from the body outwards"

    width: float = size_setting(2.0, "Width", "Span of the spread wings")
    height: float = size_setting(1.7, "Height", "Height of the wings")
    notch: float = setting(
        0.25, "Notch", "How deep the notch between fore and hind wing is", low=0.0, high=0.8
    )
    hind: float = setting(
        0.9, "Hind Wings", "Size of the hind wings over that of the fore wings", low=0.4, high=1.2
    )
    lift: float = setting(
        20.0, "Lift", "Degrees by which the wings are folded back, away from the front",
        low=-60.0, high=60.0,
    )  # fmt: skip
    scallops: float = setting(
        0.08, "Scallops", "How far the wings' rims dip between veins: share of their length",
        low=0.0, high=0.5,
    )  # fmt: skip
    ruffle: float = setting(
        0.03, "Ruffle", "How far the rims swing to and fro: share of the height",
        low=0.0, high=0.2,
    )  # fmt: skip
    wings: str = setting(
        "FOUR", "Wings", "What is one splash",
        items=(
            ("FOUR", "Four", "Fore and hind wings are splashes of their own: clear outlines"),
            ("TWO", "Two", "Each side is one splash: liquid closes the notch between its wings"),
        ),
    )  # fmt: skip
    strokes: int = setting(
        16, "Strokes", "Strokes of each side: more of them make fuller and smoother liquid",
        low=10, high=20,
    )  # fmt: skip

    def paths(self) -> Paths:
        """Return the veins of the left and of the right wings."""
        hind = self.strokes // 2
        flat = self.veins(HIND_RIM * self.hind, HIND_ROOTS, hind)
        flat += self.veins(FORE_RIM, FORE_ROOTS, self.strokes - hind)
        right = [self.lifted(vein) for vein in fitted(flat, self.width, self.height)]
        left = [vein * [-1, 1, 1] for vein in right]
        if self.wings == "TWO":
            return {"Left Wings": left, "Right Wings": right}
        return {
            "Left Hind Wing": left[:hind],
            "Right Hind Wing": right[:hind],
            "Left Fore Wing": left[hind:],
            "Right Fore Wing": right[hind:],
        }

    def lifted(self, vein: np.ndarray) -> np.ndarray:
        """Return a flat vein ``(n, 3)`` as one of a wing that is bent and lifted."""
        x, y, z = vein.T
        turn = np.radians(self.lift)
        bulge = 0.05 * self.height * np.sin(np.pi * shares(len(x)))
        return np.stack([np.cos(turn) * x, np.sin(turn) * x + bulge + y, z], axis=1)

    def veins(self, rim: np.ndarray, roots: np.ndarray, count: int) -> list[np.ndarray]:
        """Return flat strokes ``(n, 3)`` from the body to the rim of a wing.

        rim, roots : ``(m, 2)`` and ``(2, 2)``, x and z, from the notch outwards.
        """
        share = shares()[:, None]
        paths: list[np.ndarray] = []
        for place in np.linspace(0.0, 1.0, count):
            corner = place * (len(rim) - 1)
            tip = np.array([np.interp(corner, np.arange(len(rim)), rim[:, n]) for n in range(2)])
            tip = tip * (1 - self.notch * (1 - place) ** 3)
            root = roots[0] + place * (roots[1] - roots[0])
            # Veins leave the body sideways, then bend up or down to the rim.
            middle = root + (tip - root) * [0.6, 0.38]
            path = (1 - share) ** 2 * root + 2 * share * (1 - share) * middle + share**2 * tip
            path = np.insert(path, 1, 0.0, axis=1)
            # Every second vein is shorter, and ends before the others, not beside them.
            dips = len(paths) % 2
            path[:, 1] = self.ruffle * self.height * (1 - 2 * dips) * share[:, 0] ** 2
            paths.append(shortened(path, 1 - self.scallops * dips))
        return paths


@dataclass(frozen=True)
class LetterS(SketchPreset):
    """A letter S, a ribbon that is written from its upper end."""

    label: ClassVar[str] = "Letter S"
    about: ClassVar[str] = "A letter S: a ribbon written in one sweep, as by a broad pen"

    height: float = size_setting(2.0, "Height", "Height of the letter")
    width: float = size_setting(1.5, "Width", "Width of the letter, upright")
    thickness: float = size_setting(
        0.5, "Thickness", "Width of the ribbon that the line is", low=0.05, high=0.8
    )
    slant: float = setting(
        8.0, "Slant", "Degrees that the letter leans to the right", low=-30.0, high=45.0
    )
    twist: float = setting(
        0.3, "Twist", "Turns of the ribbon around the line on its way", low=-3.0, high=3.0
    )
    jags: float = setting(
        0.06, "Jags", "How far the letter's end dips between strokes: share of its length",
        low=0.0, high=0.3,
    )  # fmt: skip
    strokes: int = strokes_setting(7)

    def paths(self) -> Paths:
        """Return strokes side by side along the letter."""
        upper = half_letter()
        flat = np.concatenate([upper, -upper[-2::-1]]) * [self.width / 2, self.height / 2]
        centre = np.insert(flat, 1, 0.0, axis=1)
        width = self.thickness * (0.45 + 0.55 * np.sin(np.pi * shares(len(centre)) ** 0.8))
        turns = (-self.twist / 2, self.twist / 2)
        paths = ribbon(centre, width, self.strokes, turns, 0.15, self.jags)
        lean = np.eye(3)
        lean[2, 0] = np.tan(np.radians(self.slant))
        return {"Letter S": [path @ lean for path in fitted(paths, self.width, self.height, False)]}


def fitted(
    paths: list[np.ndarray], width: float, height: float, mirrored: bool = True
) -> list[np.ndarray]:
    """Return paths ``(n, 3)``, scaled: ``height`` from z to z, and ``width`` from x to x.

    mirrored : what is made is one half of it, up to ``width`` / 2 along +x.
    """
    together = np.concatenate(paths)
    low, high = together.min(axis=0), together.max(axis=0)
    wide = 2 * high[0] if mirrored else high[0] - low[0]
    scale = np.array([width / wide, 1.0, height / (high[2] - low[2])])
    return [path * scale for path in paths]


def half_letter() -> np.ndarray:
    """Return the upper half of an S ``(n, 2)``, from its end to the middle, 1 high, -1..1 wide."""
    # Most of an ellipse: from its right over top and left to the middle of the letter.
    angle = np.radians(np.linspace(40.0, 270.0, LONG // 2))
    return np.stack([np.cos(angle), 0.5 + 0.5 * np.sin(angle)], axis=1)
