# SPDX-License-Identifier: GPL-3.0-or-later
"""Example sketches, drawn by code at the speed of a hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .drawing import Drawing
from .strokes import arc_length

POINTS = 48
"""Points along each stroke."""

HAND_SPEED = 4.0
"""Units per second: half a metre per second where a sketch two units wide stands for 0.25 m."""


def draw(path: np.ndarray, speed: float = HAND_SPEED) -> Drawing:
    """Return the stroke along ``path`` ``(n, 3)``, Blender units, at a constant ``speed``."""
    return Drawing(path, arc_length(path) / speed, np.ones(len(path)))


def crown() -> list[Drawing]:
    """Return a crown: liquid thrown up and outwards from a ring, 2 units wide."""
    strokes = []
    share = np.linspace(0, 1, POINTS)
    for n in range(12):
        angle = 2 * np.pi * n / 12 + 0.1 * (-1) ** n
        height = 0.75 + 0.12 * (-1) ** n
        radius = 0.35 + 0.65 * share**1.3
        rise = height * np.sin(share * np.pi / 2)
        strokes.append(
            draw(np.stack([radius * np.cos(angle), radius * np.sin(angle), rise], axis=1))
        )
    return strokes


def jet() -> list[Drawing]:
    """Return a jet that comes down and spreads over a point, 2 units wide."""
    share = np.linspace(0, 1, POINTS)
    strokes = []
    for n in range(9):
        angle = 2 * np.pi * n / 9
        out = np.array([np.cos(angle), np.sin(angle)])
        bend = np.clip((share - 0.35) / 0.65, 0, 1)
        radius = 0.08 + 0.95 * bend**1.2
        height = 0.9 - 1.0 * np.minimum(share / 0.4, 1.0) ** 1.2 + 0.12 * np.sin(bend * np.pi)
        strokes.append(draw(np.stack([out[0] * radius, out[1] * radius, height], axis=1)))
    return strokes


def wave() -> list[Drawing]:
    """Return a sheet that curls over like a breaking wave, 2 units long."""
    share = np.linspace(0, 1, POINTS)
    strokes = []
    for n in range(7):
        across = 0.8 * (n / 6 - 0.5)
        angle = np.pi * (0.05 + 1.05 * share)
        radius = 1.0 - 0.25 * share
        x = -radius * np.cos(angle)
        z = radius * np.sin(angle) * (0.85 + 0.1 * np.cos(2 * across))
        y = across * (1 + 0.5 * share)
        strokes.append(draw(np.stack([x, y, z], axis=1)))
    return strokes


SKETCHES: dict[str, Callable[[], list[Drawing]]] = {"crown": crown, "jet": jet, "wave": wave}
"""The bundled sketches by name."""


def example_sketch(name: str = "crown") -> list[Drawing]:
    """Return a bundled sketch; ValueError names those there are."""
    if name not in SKETCHES:
        raise ValueError(f"no sketch {name!r}: there are {', '.join(SKETCHES)}")
    return SKETCHES[name]()
