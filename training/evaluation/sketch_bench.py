# SPDX-License-Identifier: GPL-3.0-or-later
"""The sketch bench: splashes of test sketches, made as the add-on makes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from liquid_splash_addon.core.condition.patches.sampling import PatchSamples
from liquid_splash_addon.core.condition.voxelize import outside_share, voxelize
from liquid_splash_addon.core.generator.generator import Generator
from liquid_splash_addon.core.grid import LOCAL_SPACING
from liquid_splash_addon.core.pipeline import Splash, make_splash
from liquid_splash_addon.core.settings import SplashSettings
from liquid_splash_addon.core.sketch.drawing import Drawing, strokes_from_drawings
from liquid_splash_addon.core.sketch.local_frame import Frame
from liquid_splash_addon.core.sketch.strokes import Stroke, StrokeError

from ..measures.shapes import attached_share, coverage, far_share, pieces, seen_liquid
from .letters import PAGE_FRAME, letter_page

FAR_FROM_STROKES = 16 * LOCAL_SPACING
"""Metres from all strokes beyond which hardly any liquid belongs: sixteen full cells."""

BENCH_SIZE = 0.275
"""Real size of the sketches, metres: leaves room in the box for strokes that are added."""

SIZE_SHARES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
"""Shares of the default size that are tried in turn until a sketch fits."""


class SketchBench:
    """Makes splashes with one generator.

    Attributes
    ----------
    generator : the weights that are tried
    settings : the add-on's defaults except for size, resolution and device
    """

    def __init__(self, generator: Generator, cells: int) -> None:
        self.generator = generator
        self.settings = SplashSettings(real_size=BENCH_SIZE, resolution=str(cells), device="CPU")

    def splash(
        self, drawings: Sequence[Drawing], frame: Frame | None = None, **changes: Any
    ) -> Splash:
        """Return the splash of ``drawings``, in a kept frame if given.

        changes : to the settings. Drawings without times are drawn at the stroke speed.
        """
        settings = replace(self.settings, **changes)
        scale = None if frame is None else frame.scale
        strokes, _ = strokes_from_drawings(drawings, settings, scale)
        return make_splash(strokes, settings, self.generator, frame)

    def fitting_splash(self, drawings: Sequence[Drawing]) -> Splash:
        """Return the splash at the default size, or at the first smaller one that fits the box.

        Sketches with most of their strokes at one end reach out of it at the default.
        """
        for share in SIZE_SHARES:
            try:
                return self.splash(drawings, real_size=share * self.settings.real_size)
            except StrokeError as error:
                refusal = error
        raise refusal


def liquid(splash: Splash) -> np.ndarray:
    """Return the occupied cells of a splash, bool ``(X, Y, Z)``."""
    return np.asarray(splash.fields.occupancy > 0.5)


def local_lines(drawings: Sequence[Drawing], splash: Splash) -> list[Stroke]:
    """Return the drawings in the splash's local metres, without speed."""
    still = [Stroke(d.points, np.zeros_like(d.points)) for d in drawings]
    return splash.frame.strokes_to_local(still)


def stroke_cells(drawings: Sequence[Drawing], splash: Splash) -> np.ndarray:
    """Return the cells of the splash's grid that drawings cross, bool ``(X, Y, Z)``."""
    return voxelize(local_lines(drawings, splash), splash.fields.grid, PatchSamples.none()).drawn


def silhouette(splash: Splash) -> np.ndarray:
    """Return the outline of a splash on the letters' page, bool ``(pixels, pixels)``."""
    page = letter_page(splash.fields.grid.shape[0])
    return np.asarray(seen_liquid(splash.fields, splash.frame, PAGE_FRAME, page).any(axis=2))


def keeping_to_strokes(drawings: Sequence[Drawing], splash: Splash) -> dict[str, float]:
    """Return how well a splash keeps to its strokes.

    coverage : share of stroke cells with liquid within a cell; attached : share of the liquid
    in pieces that touch strokes; largest : share of it in the largest piece; occupied : share
    of the box; far : share of the liquid farther than FAR_FROM_STROKES from all strokes; outside :
    share of the strokes outside the box, which can have no liquid (the pipeline allows a few).
    """
    wet, drawn = liquid(splash), stroke_cells(drawings, splash)
    return {
        "coverage": coverage(wet, drawn, within=1),
        "attached": attached_share(wet, drawn),
        "largest": pieces(wet)[0] / wet.sum() if wet.any() else 0.0,
        "occupied": float(wet.mean()),
        "far": far_share(wet, drawn, FAR_FROM_STROKES / splash.fields.grid.spacing),
        "outside": outside_share(local_lines(drawings, splash), splash.fields.grid),
    }


def worst(rows: dict[str, dict[str, float]]) -> dict[str, float]:
    """Return the worst of each figure of :func:`keeping_to_strokes`."""
    highest = ("occupied", "far", "outside")
    names = ("coverage", "attached", "largest", *highest)
    return {n: (max if n in highest else min)(row[n] for row in rows.values()) for n in names}
