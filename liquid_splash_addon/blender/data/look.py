# SPDX-License-Identifier: GPL-3.0-or-later
"""What a splash or a model remembers of its look: what shaders are to know of its mesh."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from bpy.props import BoolProperty, PointerProperty, StringProperty

from .revisions import changed

METRES = "metres_per_unit"
"""Custom property of splashes, models and their drops: metres at real size per unit of the object.
Shaders read it, also where this add-on is not installed."""


class SplashLookGroup(bpy.types.PropertyGroup):
    """What shaders and geometry nodes can know of a splash or a model."""

    attributes: BoolProperty(
        name="Shader Attributes",
        description="Write what shaders and geometry nodes can use to every vertex: thickness, "
        "rim, age, stroke, along and across. Materials of liquids that need them switch this on "
        "by themselves",
        update=changed,
    )
    stroke_colours: BoolProperty(
        name="Stroke Colors",
        description="Let strokes color the liquid around them, by the attribute 'tint': each by "
        "its material, or by the tint of its layer. Strokes in Splash Ink leave the liquid as it "
        "is. Regenerate after changing the colors of strokes",
        update=changed,
    )
    colours: StringProperty(
        description="Colours of the strokes that the liquid was made of, four numbers each"
    )


def colours_to_text(colours: Sequence[tuple[float, float, float] | None]) -> str:
    """Return the strokes' linear colours as text, "" if none has any."""
    if not any(colours):
        return ""
    rows = [(0.0, 0.0, 0.0, 0.0) if c is None else (*c, 1.0) for c in colours]
    return " ".join(f"{value:.5g}" for row in rows for value in row)


def colours_from_text(text: str) -> np.ndarray:
    """Return the strokes' colours, float32 ``(strokes, 4)``, alpha 0 for those without."""
    return np.array(text.split(), dtype=np.float32).reshape(-1, 4)


register_classes, unregister_classes = bpy.utils.register_classes_factory((SplashLookGroup,))


def register() -> None:
    """Add ``Object.splash_look``."""
    register_classes()
    bpy.types.Object.splash_look = PointerProperty(type=SplashLookGroup)


def unregister() -> None:
    """Remove ``Object.splash_look``."""
    del bpy.types.Object.splash_look
    unregister_classes()
