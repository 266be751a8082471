# SPDX-License-Identifier: GPL-3.0-or-later
"""One run of the generator: snapshot the scene, compute, write the result.

``compute`` sees no bpy and may run in any thread; the scene changes only in ``write``, so
whatever fails before leaves it as it was.
"""

from __future__ import annotations

import hashlib
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...core.settings import SplashSettings
from ...core.sketch.drawing import Drawing, check_drawings, drawing_scale, strokes_from_drawings
from ...core.sketch.local_frame import Frame
from ..data.frame_text import frame_from_text, frame_to_text
from ..data.preferences import keep_precision, known_precision, weights_path
from ..data.properties import assign_settings, plain
from ..data.refinements import steps_of
from ..data.version import addon_version
from ..scene import drop_points, mesh_object
from ..scene.grease_pencil import read_drawings
from ..scene.objects import SceneError, by_uid, check_writable, select_only
from ..scene.obstacles import obstacles_of
from ..scene.targets import Target
from . import dependencies, loaded_generator, refine

if TYPE_CHECKING:
    from ...core.mesh.marching_cubes import Mesh
    from ...core.obstacles.obstacles import Obstacle
    from ...core.pipeline import Drops, Report
    from ...core.refinement.settings import RefinementSettings


@dataclass(frozen=True)
class Request:
    """All that a run needs, read from the scene."""

    sketch: int  # session_uid, which outlives undo; a reference to an object does not
    splash: int | None
    layer: str
    drawings: list[Drawing]
    warnings: list[str]
    settings: SplashSettings
    frame: Frame | None
    frame_real_size: float
    weights: Path | None
    made_with: str  # hash of the weights of the last run, "" if there was none
    precision: str  # number format to compute in; "": the fastest, to be measured
    refinements: list[RefinementSettings]
    obstacles: list[Obstacle]
    clearance: float

    @property
    def digest(self) -> str:
        """What tells strokes, settings, obstacles and weights from any others."""
        from ...core.obstacles.obstacles import digest

        found = hashlib.sha256()
        for drawing in self.drawings:
            for values in (drawing.points, drawing.times, drawing.pressures):
                found.update(b"none" if values is None else np.ascontiguousarray(values).tobytes())
        around = (digest(self.obstacles), self.clearance) if self.obstacles else ()
        found.update(f"{self.settings!r} {around!r} {self.weights}".encode())
        return found.hexdigest()[:16]


@dataclass(frozen=True)
class Result:
    """All that a run leaves, ready to be written into the scene."""

    mesh: Mesh
    drops: Drops | None
    frame: Frame
    fields: bytes
    weights_hash: str
    precision: str
    device: str
    summary: str
    warnings: list[str]


def snapshot(
    context: bpy.types.Context, target: Target, settings: SplashSettings, realign: bool = False
) -> Request:
    """Read all that a run needs.

    Raises StrokeError for strokes that no splash can be made of, SceneError where the result
    could not be made or written.
    """
    if missing := dependencies.missing_packages():
        raise SceneError(f"Not installed: {', '.join(missing)}. The Splash panel says how to")
    context.view_layer.update()  # world matrices after moves by script
    sketch, splash, layer = target
    if splash is not None:
        check_writable(splash)
        layer = splash.splash.layer
    if layer and layer not in sketch.data.layers:
        raise SceneError(lost_layer(layer, sketch))
    drawings, warnings = read_drawings(sketch, layer)
    check_drawings(drawings)
    memory = splash.splash if splash is not None else None
    obstacles, clearance = obstacles_of(splash) if splash is not None else ([], 0.0)
    return Request(
        sketch=sketch.session_uid,
        splash=splash.session_uid if splash is not None else None,
        layer=layer,
        drawings=drawings,
        warnings=warnings,
        settings=settings,
        frame=frame_from_text(memory.frame) if memory and memory.frame and not realign else None,
        frame_real_size=plain(memory.frame_real_size) if memory else 0.0,
        weights=weights_path(context),
        made_with=memory.weights_hash if memory else "",
        precision=(memory.precision if memory else "") or known_precision(context, settings.device),
        refinements=steps_of(splash) if splash is not None else [],
        obstacles=obstacles,
        clearance=clearance,
    )


def lost_layer(layer: str, sketch: bpy.types.Object) -> str:
    """Return what to say about a splash whose layer is gone."""
    return (
        f"Layer '{layer}' of '{sketch.name}' was deleted or renamed: its splash is kept as it is. "
        "Choose another layer under Last Run, or delete the splash"
    )


def compute(request: Request, report: Report) -> Result:
    """Make the splash; no bpy here. Raises what core raises."""
    from ...core.pipeline import make_splash

    start = time.perf_counter()
    settings = request.settings
    report("Reading the strokes", 0.0)
    frame = stored_frame(request)
    strokes, stroke_warnings = strokes_from_drawings(
        request.drawings, settings, frame.scale if frame is not None else None
    )
    report("Loading the generator", 0.02)
    generator = loaded_generator.get(request.weights, settings.device, request.precision)
    splash = make_splash(
        strokes, settings, generator, frame, part_of(report, 0.1, 0.9),
        request.refinements, request.obstacles, request.clearance,
    )  # fmt: skip
    report("Packing the fields", 0.9)
    warnings = [*request.warnings, *stroke_warnings, *splash.warnings]
    if request.made_with not in ("", generator.weights_hash):
        warnings.append("Other weights than last time: the splash may look different")
    if request.precision not in ("", generator.precision):
        warnings.append(
            f"Made in the format {generator.precision}: {request.precision} is not to be had on "
            f"this device. The splash may look a little different"
        )
    fields = splash.fields.to_bytes()
    seconds = time.perf_counter() - start
    return Result(
        mesh=splash.mesh,
        drops=splash.drops,
        frame=splash.frame,
        fields=fields,
        weights_hash=generator.weights_hash,
        precision=generator.precision,
        device=generator.device,
        summary=f"{len(splash.mesh.faces):,} faces in {seconds:.1f} s",
        warnings=list(dict.fromkeys(warnings)),
    )


def part_of(report: Report, first: float, last: float) -> Report:
    """Return the report for a part of the work that goes from ``first`` to ``last``, of 0..1."""
    return lambda stage, share: report(stage, first + share * (last - first))


def stored_frame(request: Request) -> Frame | None:
    """Return the frame of the last run, scaled anew if the real size was changed since."""
    frame, real_size = request.frame, request.settings.real_size
    if frame is None or real_size == request.frame_real_size:
        return frame
    return replace(frame, scale=drawing_scale(request.drawings, real_size))


def write(context: bpy.types.Context, request: Request, result: Result) -> bpy.types.Object:
    """Write a result into the scene and return the splash object.

    Raises SceneError if the sketch or the splash went away while the result was computed.
    """
    sketch = by_uid(request.sketch)
    splash = by_uid(request.splash) if request.splash is not None else None
    if sketch is None or (splash is None and request.splash is not None):
        raise SceneError("The sketch or its splash was deleted meanwhile")
    context.view_layer.update()
    if splash is None:
        splash = mesh_object.new_object(context, sketch, request.layer)
        if sketch.mode == "OBJECT":  # else leave the artist in the middle of the drawing
            select_only(context, splash)
    else:
        check_writable(splash)
        mesh_object.follow_sketch(splash, sketch)
    mesh_object.write_mesh(splash.data, result.mesh)
    drop_points.write(splash, result.drops)
    mesh_object.store_fields(splash.data, result.fields)
    context.view_layer.update()
    remember(splash, sketch, request, result)
    if request.precision != result.precision:
        keep_precision(context, request.settings.device, result.precision)
    return splash


def remember(
    splash: bpy.types.Object, sketch: bpy.types.Object, request: Request, result: Result
) -> None:
    """Note on the splash how it was made."""
    memory = splash.splash
    assign_settings(memory.settings, request.settings)
    memory.version = addon_version()
    memory.made_of = request.digest
    memory.frame = frame_to_text(result.frame)
    memory.frame_real_size = request.settings.real_size
    memory.weights_hash = result.weights_hash
    memory.precision = result.precision
    memory.device = result.device
    memory.summary = result.summary
    memory.warnings = "\n".join(result.warnings)
    mesh_object.remember_place(splash, sketch)
    refine.remember(splash, refine.task_of(splash).name, [], [])
