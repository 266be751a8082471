# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of strokes to sketches and back: reading and writing in a thread, the scene outside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from mathutils import Matrix

from ...core.sketch.drawing import Drawing
from ...core.sketch.flow import as_if_drawn
from ...core.stroke_files.limits import StrokeFileError
from ...core.stroke_files.reading import file_bytes, read_recording
from ...core.stroke_files.recording import Recording, size_warnings
from ..scene import sketch
from ..scene.objects import enter_object_mode, select_only
from ..scene.stroke_objects import read_sketch

if TYPE_CHECKING:
    from ...core.progress import Report

INK_SHARE = 0.005
"""Radius of a stroke at full pressure, over the sketch's longest side: as in the presets."""


@dataclass(frozen=True)
class Import:
    """A file as it was read, ready to be made a sketch.

    Attributes
    ----------
    name : of the sketch
    drawings : strokes about the origin, Blender units
    centre : float64 ``(3,)``, where the origin was in the file, Blender units
    radius : of a stroke at full pressure, Blender units
    recording : what was read
    """

    name: str
    drawings: list[Drawing]
    centre: np.ndarray
    radius: float
    recording: Recording


def read_files(
    paths: Sequence[Path], scale: float, report: Report
) -> tuple[list[Import], list[str]]:
    """Read files, without bpy; return them and what is said of those that cannot be read.

    scale : Blender units per metre
    Raises StrokeFileError where none can be read.
    """
    found, errors = [], []
    for number, path in enumerate(paths):
        report(f"Reading {path.name}", number / len(paths))
        try:
            found.append(prepared(path.stem, read_recording(path), scale))
        except StrokeFileError as error:
            errors.append(str(error))
        except OSError as error:
            errors.append(f"{path.name} could not be read: {error.strerror or error}")
    if not found:
        raise StrokeFileError(" / ".join(errors) or "No file was chosen: choose at least one")
    return found, errors


def prepared(name: str, recording: Recording, scale: float) -> Import:
    """Return a recording about the middle of its box, so that it stands where its object does."""
    low = np.min([drawing.points.min(axis=0) for drawing in recording.drawings], axis=0)
    high = np.max([drawing.points.max(axis=0) for drawing in recording.drawings], axis=0)
    middle = (low + high) / 2
    drawings = [
        replace(
            drawing,
            points=scale * (drawing.points - middle),
            speeds=None if drawing.speeds is None else scale * drawing.speeds,
        )
        for drawing in recording.drawings
    ]
    return Import(name, drawings, scale * middle, INK_SHARE * scale * recording.size, recording)


def add_sketches(
    context: bpy.types.Context, imports: Sequence[Import], at_cursor: bool
) -> list[str]:
    """Add a Grease Pencil object for each file, select them, and return warnings.

    at_cursor : whether its middle is put at the 3D cursor, instead of where it was in the file
    """
    enter_object_mode(context)
    warnings, made = [], []
    real_size = context.scene.splash.settings.real_size
    for found in imports:
        place = context.scene.cursor.location if at_cursor else found.centre.tolist()
        item = sketch.new_sketch(context, Matrix.Translation(place))
        item.name = item.data.name = found.name
        sketch.add_strokes(item, found.drawings, radius=found.radius)
        made.append(item)
        said = [*found.recording.warnings, *size_warnings(found.recording, real_size)]
        if any(drawing.speeds is not None for drawing in found.drawings):
            said.append("The file stores speeds: set Speed to Attribute to use them")
        warnings += [f"{found.name}: {line}" for line in said]
    select_only(context, made[0])
    for item in made[1:]:
        item.select_set(True)
    return warnings


def world_strokes(
    objects: Sequence[bpy.types.Object], modifiers: bool
) -> tuple[list[Drawing], list[str]]:
    """Return the strokes of objects in the world, and warnings."""
    drawings, warnings = read_sketch(objects, modifiers=modifiers, to_space=np.eye(4))
    return [as_if_drawn(drawing) for drawing in drawings if len(drawing.points)], warnings


def content_of(path: Path, drawings: Sequence[Drawing], scale: float) -> bytes:
    """Return the bytes of a file, without bpy. Raises StrokeFileError.

    scale : Blender units per metre
    """
    in_metres = [
        replace(
            drawing,
            points=drawing.points / scale,
            times=drawing.times if drawing.is_timed else None,
            speeds=None if drawing.speeds is None else drawing.speeds / scale,
        )
        for drawing in drawings
    ]
    return file_bytes(path, in_metres)
