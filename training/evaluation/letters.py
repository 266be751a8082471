# SPDX-License-Identifier: GPL-3.0-or-later
"""Capital letters as strokes, and how their splashes are read (paper, 6.1 and Fig. 14)."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.ndimage import distance_transform_edt

from liquid_splash_addon.core.grid import LOCAL_CELLS, LOCAL_SPACING, Grid
from liquid_splash_addon.core.scale import Scale
from liquid_splash_addon.core.sketch.drawing import Drawing
from liquid_splash_addon.core.sketch.local_frame import Frame
from liquid_splash_addon.core.sketch.strokes import Stroke, resampled_points

from ..measures.metrics import iou

LETTER_REACH = 0.012
"""Value of the setting Reach for letters, metres at real size: lines 24 mm wide, 0.09 of their
height."""

PAGE = 1.8
"""Side of the square in which a letter of height 1 is read."""

PAGE_FRAME = Frame(
    np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    np.zeros(3),
    Scale.of_length(LOCAL_CELLS * LOCAL_SPACING / PAGE),
)
"""The page as a local frame: x to the right, y up, z towards the reader; letters lie in xz."""

PAGE_DEPTH = 0.5
"""Depth of the page over its side: liquid is seen up to a quarter of the side before and behind."""

Line = list[tuple[float, float]]


def arc(x: float, y: float, wide: float, high: float, first: float, last: float) -> Line:
    """Return an arc of the ellipse about (x, y) with these half axes; angles in degrees."""
    count = max(int(abs(last - first) / 10), 2)
    angles = np.radians(np.linspace(first, last, count))
    return [(x + wide * float(np.cos(a)), y + high * float(np.sin(a))) for a in angles]


STEM: Line = [(0, 1), (0, 0)]
TOP_BOWL: Line = [(0, 1), *arc(0.3, 0.75, 0.27, 0.25, 90, -90), (0, 0.5)]

LETTERS: dict[str, list[Line]] = {
    "A": [[(0.4, 1), (0, 0)], [(0.4, 1), (0.8, 0)], [(0.16, 0.4), (0.64, 0.4)]],
    "B": [STEM, TOP_BOWL, [(0, 0.5), *arc(0.35, 0.25, 0.3, 0.25, 90, -90), (0, 0)]],
    "C": [arc(0.42, 0.5, 0.42, 0.5, 50, 310)],
    "D": [STEM, [(0, 1), *arc(0.25, 0.5, 0.45, 0.5, 90, -90), (0, 0)]],
    "E": [STEM, [(0, 1), (0.6, 1)], [(0, 0.5), (0.5, 0.5)], [(0, 0), (0.6, 0)]],
    "F": [STEM, [(0, 1), (0.6, 1)], [(0, 0.5), (0.5, 0.5)]],
    "G": [[*arc(0.42, 0.5, 0.42, 0.5, 50, 330), (0.8, 0.45), (0.45, 0.45)]],
    "H": [STEM, [(0.7, 1), (0.7, 0)], [(0, 0.5), (0.7, 0.5)]],
    "I": [STEM],
    "J": [[(0.5, 1), *arc(0.25, 0.25, 0.25, 0.25, 0, -180)]],
    "K": [STEM, [(0.65, 1), (0, 0.42)], [(0.2, 0.6), (0.7, 0)]],
    "L": [STEM, [(0, 0), (0.6, 0)]],
    "M": [STEM, [(0, 1), (0.45, 0.25)], [(0.9, 1), (0.45, 0.25)], [(0.9, 1), (0.9, 0)]],
    "N": [STEM, [(0, 1), (0.7, 0)], [(0.7, 1), (0.7, 0)]],
    "O": [arc(0.42, 0.5, 0.42, 0.5, 90, 450)],
    "P": [STEM, TOP_BOWL],
    "Q": [arc(0.42, 0.5, 0.42, 0.5, 90, 450), [(0.5, 0.3), (0.85, -0.1)]],
    "R": [STEM, TOP_BOWL, [(0.2, 0.5), (0.62, 0)]],
    "S": [[*arc(0.32, 0.75, 0.3, 0.25, 35, 270), *arc(0.32, 0.25, 0.32, 0.25, 90, -145)]],
    "T": [[(0, 1), (0.8, 1)], [(0.4, 1), (0.4, 0)]],
    "U": [[(0, 1), *arc(0.35, 0.3, 0.35, 0.3, 180, 360), (0.7, 1)]],
    "V": [[(0, 1), (0.4, 0)], [(0.8, 1), (0.4, 0)]],
    "W": [
        [(0, 1), (0.25, 0)], [(0.5, 0.8), (0.25, 0)],
        [(0.5, 0.8), (0.75, 0)], [(1, 1), (0.75, 0)],
    ],
    "X": [[(0, 1), (0.7, 0)], [(0.7, 1), (0, 0)]],
    "Y": [[(0, 1), (0.4, 0.5)], [(0.8, 1), (0.4, 0.5)], [(0.4, 0.5), (0.4, 0)]],
    "Z": [[(0, 1), (0.65, 1)], [(0.65, 1), (0, 0)], [(0, 0), (0.65, 0)]],
}  # fmt: skip
"""Lines of each letter, height 1, as a pen would draw them: one to five strokes as in Fig. 14."""


def letter_drawings(letter: str) -> list[Drawing]:
    """Return the strokes of a capital letter, one unit high, about the origin in the xz plane."""
    lines = [np.array(line, dtype=float) for line in LETTERS[letter]]
    together = np.concatenate(lines)
    middle = (together.max(axis=0) + together.min(axis=0)) / 2
    return [Drawing(np.insert(line - [middle[0], 0.5], 1, 0.0, axis=1)) for line in lines]


def letter_page(pixels: int) -> Grid:
    """Return the page's grid in PAGE_FRAME, ``pixels`` wide and high."""
    deep = round(pixels * PAGE_DEPTH)
    return Grid.local(pixels).crop((0, 0, (pixels - deep) // 2), (pixels, pixels, deep))


@cache
def skeleton_distance(letter: str, pixels: int) -> np.ndarray:
    """Return the distance of the page's pixels to the letter's lines, ``(pixels, pixels)``.

    In pixels; the first index runs to the right, the second up.
    """
    lines = [Stroke(d.points, np.zeros_like(d.points)) for d in letter_drawings(letter)]
    page = letter_page(pixels)
    points, _ = resampled_points(PAGE_FRAME.strokes_to_local(lines), page.spacing / 2)
    drawn = np.zeros((pixels, pixels), dtype=bool)
    drawn[tuple(page.cell_of(points)[:, :2].T)] = True
    return np.asarray(distance_transform_edt(~drawn))


def template(letter: str, pixels: int, area: int) -> np.ndarray:
    """Return the letter in lines so thick that they cover ``area`` pixels, or hardly more.

    bool ``(pixels, pixels)``. How wide a splash's lines are says nothing about which letter it is.
    """
    distance = skeleton_distance(letter, pixels)
    return distance <= np.partition(distance.ravel(), area - 1)[area - 1]


def letter_scores(silhouette: np.ndarray) -> dict[str, float]:
    """Return the IoU of a silhouette with each letter of the same area.

    silhouette : bool ``(pixels, pixels)``, not empty, seen on the page.
    """
    area = int(silhouette.sum())
    return {name: iou(silhouette, template(name, len(silhouette), area)) for name in LETTERS}


def read_letter(silhouette: np.ndarray) -> str:
    """Return the letter that the silhouette is most like."""
    scores = letter_scores(silhouette)
    return max(scores, key=lambda name: scores[name])
