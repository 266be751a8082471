# SPDX-License-Identifier: GPL-3.0-or-later
"""Axes and pivots that an artist chooses: of the world, of an object or of the view."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ...core.sketch.drawing import Drawing
from ...core.sketch.tools.tool import Place
from .objects import SceneError

SPACES = (
    ("GLOBAL", "Global", "Axes of the world"),
    ("LOCAL", "Local", "Axes of the sketch object"),
    ("VIEW", "View", "Axes of the view: X to the right, Y up, Z to the viewer"),
)
PIVOTS = (
    ("CURSOR", "3D Cursor", "Through the 3D cursor"),
    ("ORIGIN", "Origin", "Through the origin of the sketch object"),
    ("CENTRE", "Centre", "Through the centre of the box around the strokes"),
)


def place_for(
    context: bpy.types.Context,
    sketch: bpy.types.Object,
    strokes: Sequence[Drawing],
    space: str,
    pivot: str,
) -> Place:
    """Return where a tool works, in the world.

    space, pivot : one of SPACES, one of PIVOTS
    Raises SceneError for axes of the view where there is none.
    """
    view = view_rotation(context)
    if space == "VIEW":
        if view is None:
            raise SceneError("There is no view here: choose Global or Local axes")
        axes = view
    elif space == "LOCAL":
        axes = np.array(sketch.matrix_world.to_quaternion().to_matrix().transposed(), dtype=float)
    else:
        axes = np.eye(3)
    towards = None if view is None else view[2]
    return Place(pivot_point(context, sketch, strokes, pivot), axes, towards)


def pivot_point(
    context: bpy.types.Context, sketch: bpy.types.Object, strokes: Sequence[Drawing], pivot: str
) -> np.ndarray:
    """Return a pivot in the world, float64 ``(3,)``."""
    if pivot == "CURSOR":
        return np.array(context.scene.cursor.location, dtype=float)
    if pivot == "ORIGIN":
        return np.array(sketch.matrix_world.translation, dtype=float)
    together = np.concatenate([stroke.points for stroke in strokes])
    return np.asarray((together.min(axis=0) + together.max(axis=0)) / 2)


def view_rotation(context: bpy.types.Context) -> np.ndarray | None:
    """Return the view's right, up and towards the viewer as rows ``(3, 3)``; None without one."""
    region = view_region(context)
    if region is None:
        return None
    return np.array(Matrix(region.view_matrix).to_3x3(), dtype=float)


def view_region(context: bpy.types.Context) -> Any:
    """Return what the 3D viewport at hand looks at: that of the context, else the largest one."""
    space = context.space_data
    if space is not None and space.type == "VIEW_3D":
        return space.region_3d
    if bpy.app.background or context.window is None:
        return None
    areas = [area for area in context.window.screen.areas if area.type == "VIEW_3D"]
    areas.sort(key=lambda area: area.width * area.height)
    return areas[-1].spaces.active.region_3d if areas else None
