# SPDX-License-Identifier: GPL-3.0-or-later
"""Test sketches for the sketch bench, in addition to the bundled ones.

None of those made here has recorded times: the speed is a setting. Units are the bundled sketches'
(about 2 wide). Those of recordings are in metres and timed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from liquid_splash_addon.core.sketch.drawing import Drawing
from liquid_splash_addon.core.sketch.presets import example_sketch
from liquid_splash_addon.core.stroke_files.reading import KINDS, read_strokes

SLOW, FAST = 0.2, 4 / 3
"""Speeds of the hand for Fig. 7, m/s at real size: 0.6 and 4 m/s of liquid at the default gain."""

STROKE_POINTS = 160
"""Points along a long stroke."""

PART_STROKES = 8
"""Strokes in a part of a recording that is tried by itself."""


def untimed(drawings: list[Drawing]) -> list[Drawing]:
    """Return the drawings without their recorded times."""
    return [Drawing(drawing.points) for drawing in drawings]


def streamlet() -> list[Drawing]:
    """Return a streamlet: seven lines side by side in a slow bend, 2 units long."""
    share = np.linspace(0, 1, STROKE_POINTS)
    lines = []
    for n in range(7):
        angle = 2 * np.pi * n / 6
        radius = 0.12 * (n > 0) * (1 + 0.4 * share)
        y = radius * np.cos(angle + share) + 0.25 * np.sin(2.5 * share)
        z = radius * np.sin(angle + share) - 0.3 * share**2
        lines.append(Drawing(np.stack([2 * share, y, z], axis=1)))
    return lines


def flows() -> dict[str, list[Drawing]]:
    """Return the sketches drawn slowly and fast (paper, Fig. 7), by name."""
    bundled = {name: untimed(example_sketch(name)) for name in ("crown", "jet", "wave")}
    return {**bundled, "streamlet": streamlet()}


def growing() -> dict[str, tuple[list[Drawing], list[Drawing]]]:
    """Return sketches, each with three strokes that are added to it later (paper, Fig. 9).

    A crown whose gap is closed, a wave that gets broader at one side, and a jet that gets
    strokes where nothing was.
    """
    crown, wave = untimed(example_sketch("crown")), untimed(example_sketch("wave"))
    share = np.linspace(0, 1, STROKE_POINTS)[:, None]
    starts = np.array([[0.1, 0, 0.4], [-0.1, 0.1, 0.5], [0, -0.1, 0.6]])
    ends = np.array([[0.5, 0.1, 1.0], [-0.4, 0.4, 0.9], [-0.1, -0.5, 1.0]])
    spray = [Drawing(a + share * (b - a)) for a, b in zip(starts, ends, strict=True)]
    return {
        "crown": (crown[:9], crown[9:]),
        "wave": (wave[:4], wave[4:]),
        "jet": (untimed(example_sketch("jet")), spray),
    }


def knot() -> list[Drawing]:
    """Return the figure-eight knot as one closed stroke."""
    t = np.linspace(0, 2 * np.pi, 2 * STROKE_POINTS)
    ring = 2 + np.cos(2 * t)
    path = np.stack([ring * np.cos(3 * t), ring * np.sin(3 * t), np.sin(4 * t)], axis=1)
    return [Drawing(path / 3)]


def tangle() -> list[Drawing]:
    """Return one stroke wound through itself: random waves along each axis."""
    rng = np.random.default_rng(4)
    t = np.linspace(0, 2 * np.pi, 2 * STROKE_POINTS)
    waves = rng.normal(size=(3, 4, 2)) / np.sqrt(np.arange(1, 5))[None, :, None]
    path = np.stack(
        [
            sum(a * np.cos(k * t) + b * np.sin(k * t) for k, (a, b) in enumerate(axis, start=1))
            for axis in waves
        ],
        axis=1,
    )
    return [Drawing(path / 3)]


def scribble() -> list[Drawing]:
    """Return one flat zigzag that crosses its own way back, as when shading with a pen."""
    share = np.linspace(0, 1, 2 * STROKE_POINTS)
    there = np.stack([2 * share - 1, 0.6 * np.sin(14 * np.pi * share), 0.05 * share], axis=1)
    back = np.stack([1 - 2 * share, 0.5 * np.sin(11 * np.pi * share), 0.1 - 0.05 * share], axis=1)
    return [Drawing(np.concatenate([there, back]))]


def crossing() -> list[Drawing]:
    """Return two strokes that meet head on at an angle, and go on."""
    share = np.linspace(-1, 1, STROKE_POINTS)
    bend = 0.2 * (1 - share**2)
    first = np.stack([share, 0.4 * share, bend], axis=1)
    return [Drawing(first), Drawing(np.stack([-share, 0.4 * share, -bend + 0.4], axis=1))]


def there_and_back() -> list[Drawing]:
    """Return one arch drawn twice, in both directions: the mean of its speeds is zero."""
    angle = np.linspace(0, np.pi, STROKE_POINTS)
    arch = np.stack([np.cos(angle), 0.3 * np.sin(2 * angle), np.sin(angle)], axis=1)
    return [Drawing(arch), Drawing(arch[::-1])]


def random_polyline() -> list[Drawing]:
    """Return one stroke straight from one random place to the next, twelve times."""
    corners = np.random.default_rng(8).uniform(-0.8, 0.8, size=(13, 3))
    return [Drawing(corners)]


def disorderly() -> dict[str, list[Drawing]]:
    """Return sketches that are no streamlines of any flow (paper, Fig. 19), by name."""
    makers = (knot, tangle, scribble, crossing, there_and_back, random_polyline)
    return {maker.__name__: maker() for maker in makers}


def recorded_sketches(directory: Path) -> dict[str, list[Drawing]]:
    """Return what to try of every recording in a directory, by name.

    The whole of it, and its first, middle and last PART_STROKES strokes: a sketch for one
    splash is small, a painting is many.
    """
    sketches = {}
    for path in sorted(p for p in directory.iterdir() if p.suffix.lower() in KINDS):
        drawings = read_strokes(path)
        sketches[path.stem] = drawings
        last = len(drawings) - PART_STROKES
        for start in sorted({0, last // 2, last}) if last > 0 else ():
            part = drawings[start : start + PART_STROKES]
            sketches[f"{path.stem} {start + 1}-{start + len(part)}"] = part
    if not sketches:
        raise ValueError(f"{directory} holds no recording ({', '.join(KINDS)})")
    return sketches
