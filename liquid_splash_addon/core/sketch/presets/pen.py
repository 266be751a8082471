# SPDX-License-Identifier: GPL-3.0-or-later
"""From paths to strokes: the speed of a hand, its asymmetry, and what all presets share."""

from __future__ import annotations

from dataclasses import Field, dataclass, fields
from typing import Any, ClassVar

import numpy as np

from ...settings import LATENT_SEED_MAX, Settings, setting
from ..drawing import Drawing
from ..local_frame import longest_side
from ..strokes import arc_length

POINTS = 48
"""Points along each stroke."""

LONG = 128
"""Points along a stroke that bends much."""

HAND_SPEED = 16 / 3
"""Units per second: 0.9 m/s where a sketch two units wide stands for 0.33 m, 2.6 m/s of liquid."""

HAND_SIZE = 2.0
"""Units across a sketch that is drawn at HAND_SPEED."""

SWAY, SHORTER, HASTE = 0.12, 0.4, 0.25
"""What asymmetry 1 does: sway over the sketch's size, share that the shortest strokes lose, and
the share by which speeds differ."""

MODES = 5
"""Waves that make up the sway."""

Paths = dict[str, list[np.ndarray]]
"""Polylines ``(n, 3)``, Blender units, by layer. Each layer is one splash."""


@dataclass(frozen=True)
class SketchPreset(Settings):
    """The controls of one preset sketch. Lengths are Blender units, z is up."""

    label: ClassVar[str]
    about: ClassVar[str]

    asymmetry: float = setting(
        0.25,
        "Asymmetry",
        "How much the strokes sway and how much their lengths and speeds differ, as if by hand",
        low=0.0,
        high=1.0,
    )
    seed: int = setting(0, "Seed", "Which of all possible asymmetries", low=0, high=LATENT_SEED_MAX)

    @classmethod
    def controls(cls) -> list[Field[Any]]:
        """Return the controls in the order to show them: its own, then those that all have."""
        shared = [item.name for item in fields(SketchPreset)]
        return sorted(fields(cls), key=lambda item: item.name in shared)

    @property
    def size(self) -> float:
        """Longest side, units."""
        sides = ("width", "height", "length")
        return max(float(getattr(self, side)) for side in sides if hasattr(self, side))

    def paths(self) -> Paths:
        """Return what is drawn, before any asymmetry, each path along the flow."""
        raise NotImplementedError

    def layers(self) -> dict[str, list[Drawing]]:
        """Return the strokes by layer; each layer is to become one splash."""
        rng = np.random.default_rng(self.seed)
        waves = random_waves(rng, self.size)
        layers = {}
        for name, paths in self.paths().items():
            # People draw large things faster, in about the same time (isochrony). So size alone
            # does not change a splash, whose longest side is its real size.
            speed = HAND_SPEED * longest_side(paths) / HAND_SIZE
            lengths = 1 - self.asymmetry * SHORTER * rng.uniform(0, 1, len(paths)) ** 2
            hastes = 1 + self.asymmetry * HASTE * rng.uniform(-1, 1, len(paths))
            layers[name] = [
                draw(swayed(shortened(path, length), self.asymmetry, waves), speed * haste)
                for path, length, haste in zip(paths, lengths, hastes, strict=True)
            ]
        return layers


def draw(path: np.ndarray, speed: float = HAND_SPEED) -> Drawing:
    """Return the stroke along ``path`` ``(n, 3)``, Blender units, at a constant ``speed``."""
    return Drawing(path, arc_length(path) / speed, np.ones(len(path)))


def random_waves(rng: np.random.Generator, size: float) -> tuple[np.ndarray, ...]:
    """Return wave vectors ``(MODES, 3)``, phases ``(MODES,)`` and amplitudes ``(MODES, 3)``.

    Their sum moves points by about SWAY * ``size``. The waves are about as long as the sketch,
    so that neighbours sway alike and strokes do not cross.
    """
    vectors = rng.normal(size=(MODES, 3))
    vectors *= 2 * np.pi / (1.2 * size) / np.linalg.norm(vectors, axis=1, keepdims=True)
    amplitudes = rng.normal(size=(MODES, 3)) * SWAY * size / np.sqrt(MODES)
    return vectors, rng.uniform(0, 2 * np.pi, MODES), amplitudes


def swayed(path: np.ndarray, amount: float, waves: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return ``path`` ``(n, 3)`` moved by the waves, the more the farther from its start."""
    vectors, phases, amplitudes = waves
    along = arc_length(path)
    # From the start of a stroke on, so that the source stays whole.
    share = (along / along[-1])[:, None]
    return path + amount * share * (np.sin(path @ vectors.T + phases) @ amplitudes)


def shortened(path: np.ndarray, share: float) -> np.ndarray:
    """Return the first ``share`` of the length of ``path`` ``(n, 3)``, with as many points."""
    along = arc_length(path)
    if share >= 1:
        return path
    places = along * share
    return np.stack([np.interp(places, along, path[:, axis]) for axis in range(3)], axis=1)


def jagged(paths: list[np.ndarray], jags: float, rounding: float = 0.0) -> list[np.ndarray]:
    """Return paths ``(n, 3)`` that lie side by side, of lengths that make a front with points.

    jags : share by which every second one is shorter, counted from the middle; rounding : share by
    which the outermost are shorter than those in the middle.
    """
    middle = (len(paths) - 1) / 2
    lengths = [
        (1 - jags * (int(abs(n - middle)) % 2)) * (1 - rounding * ((n - middle) / middle) ** 2)
        for n in range(len(paths))
    ]
    return [shortened(path, length) for path, length in zip(paths, lengths, strict=True)]


def shares(points: int = POINTS) -> np.ndarray:
    """Return numbers from 0 to 1, one a point, float64 ``(points,)``."""
    return np.linspace(0.0, 1.0, points)


def strokes_setting(default: int, low: int = 5, high: int = 20) -> Any:
    """Return the setting of the number of strokes."""
    text = "Strokes side by side: more of them make fuller and smoother liquid"
    return setting(default, "Strokes", text, low=low, high=high)


def size_setting(
    default: float, label: str, description: str, low: float = 0.5, high: float = 4.0
) -> Any:
    """Return the setting of a length, in units."""
    return setting(default, label, f"{description}, in Blender units", low=low, high=high)
