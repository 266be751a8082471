# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of splashes with their strokes, on sheets like the paper's figures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import ImageDraw
from PIL.Image import Image
from scipy.spatial.transform import Rotation

from liquid_splash_addon.core.grid import LOCAL_CELLS, Grid
from liquid_splash_addon.core.pipeline import Splash
from liquid_splash_addon.core.sketch.drawing import Drawing
from liquid_splash_addon.core.sketch.local_frame import Frame

from ..figures.picture import camera_axes, contact_sheet, draw_liquid, safe_distance
from ..measures.shapes import resampled
from .bench_sketches import FAST, SLOW, disorderly, flows, growing
from .letters import LETTER_REACH, LETTERS, letter_drawings
from .sketch_bench import SketchBench

ASIDE = Rotation.from_euler("zx", [18, -10], degrees=True).as_matrix()
"""Turn of a letter away from the viewer: seen straight from the front, liquid looks flat."""

STROKE_MARGIN, NARROWEST = 14.0, 0.75 * LOCAL_CELLS
"""Cells around the strokes in a picture, and across the narrowest one."""

TITLE_INK = (40, 40, 40)
"""Colour of titles."""


def portrait(
    splash: Splash, drawings: Sequence[Drawing], title: str, pixels: int, facing: bool = False
) -> Image:
    """Return a square picture of a splash and its strokes, upright as they were drawn.

    facing : look at the drawing's xz plane from the front, as at a letter.
    """
    axes = facing_axes() if facing else np.eye(3)
    seen = Frame(axes, splash.frame.centre, splash.frame.scale)
    grid = Grid.local(LOCAL_CELLS)
    distance = resampled(safe_distance(splash.fields), splash.fields.grid, splash.frame, seen, grid)
    distance *= splash.fields.grid.spacing / grid.spacing
    lines = [grid.to_cells(seen.points_to_local(d.points.astype(float))) for d in drawings]
    centre, width = framing(lines)
    picture = draw_liquid(distance, pixels, strokes=lines, centre=centre, width=width)
    ImageDraw.Draw(picture).text((5, 3), title, fill=TITLE_INK)
    return picture


def framing(lines: Sequence[np.ndarray]) -> tuple[np.ndarray, float]:
    """Return the centre ``(3,)`` and width that show all of the lines with room for liquid.

    lines : ``(n, 3)`` each, cells. Small sketches are not drawn larger than NARROWEST allows.
    """
    axes = camera_axes()
    seen = np.concatenate(lines) @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    width = float((high - low)[:2].max()) + 2 * STROKE_MARGIN
    return (low + high) / 2 @ axes, max(width, NARROWEST)


def facing_axes() -> np.ndarray:
    """Return axes ``(3, 3)`` in which the camera sees the drawing's xz plane nearly from front."""
    right, down, forward = camera_axes()
    # Columns: where the drawing's x, y (away from the reader) and z (up) go.
    return np.asarray(np.stack([right, forward, -down], axis=1) @ ASIDE)


def claims_sheet(bench: SketchBench, pixels: int) -> Image:
    """Return a sheet of 8 columns.

    First row (Fig. 7): each sketch drawn slowly, then fast. Second (Fig. 9): two sketches, and
    one to three strokes added to each. Then the alphabet (Fig. 14) and, at its end, sketches
    that are no streamlines (Fig. 19).
    """
    pictures = []
    for name, drawings in flows().items():
        for speed in (SLOW, FAST):
            splash = bench.splash(drawings, stroke_speed=speed)
            title = f"{name}, {speed * bench.settings.speed_gain:g} m/s"
            pictures.append(portrait(splash, drawings, title, pixels))
    for name in ("crown", "jet"):
        first, more = growing()[name]
        frame = None
        for count in range(len(more) + 1):
            drawings = [*first, *more[:count]]
            splash = bench.splash(drawings, frame)
            frame = splash.frame
            pictures.append(portrait(splash, drawings, f"{name} + {count}", pixels))
    for letter in LETTERS:
        drawings = letter_drawings(letter)
        splash = bench.splash(drawings, reach=LETTER_REACH)
        pictures.append(portrait(splash, drawings, letter, pixels, facing=True))
    for name, drawings in disorderly().items():
        title = name.replace("_", " ")
        pictures.append(portrait(bench.splash(drawings), drawings, title, pixels))
    return contact_sheet(pictures, 8)


def recorded_sheet(bench: SketchBench, sketches: dict[str, list[Drawing]], pixels: int) -> Image:
    """Return a sheet of recordings, each whole and in parts, in rows of 4."""
    pictures = [portrait(bench.fitting_splash(d), d, n, pixels) for n, d in sketches.items()]
    return contact_sheet(pictures, 4)
