# SPDX-License-Identifier: GPL-3.0-or-later
"""One run of the generator: snapshot the scene, compute, write the result.

``compute`` uses no bpy and may run in any thread. Only ``write`` changes the scene, so a failure
before it leaves the scene as it was.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import bpy
import numpy as np

from ...core.refinement.viscous import for_liquid
from ...core.settings import SplashSettings
from ...core.sketch.drawing import Drawing, drawing_scale, strokes_from_drawings, usable_drawings
from ...core.sketch.local_frame import Frame
from ...core.sketch.strokes import StrokeError
from ..data import stored_liquid
from ..data.frame_text import frame_from_text, frame_to_text
from ..data.preferences import device_for, keep_precision, known_precision, weights_path
from ..data.properties import STROKE_TYPES, assign_settings, plain, to_settings
from ..data.refinements import add_step, steps_of
from ..data.start import starting_steps
from ..data.version import addon_version
from ..scene import drop_points, follow, mesh_object, mesh_space, motion, targets
from ..scene.objects import Handle, SceneError, check_writable, select_only
from ..scene.obstacles import obstacles_key, obstacles_of
from ..scene.stroke_objects import read_sketch
from ..scene.targets import Target, others_of
from . import compile_ahead, dependencies, loaded_generator, looks, refine, scheduler
from .progress import part_of

if TYPE_CHECKING:
    from ...core.composition.drops import Drops
    from ...core.mesh.mesh import Mesh
    from ...core.obstacles.obstacles import Obstacle
    from ...core.progress import Report
    from ...core.refinement.settings import RefinementSettings
    from ...core.refinement.shader_attributes import Attributes


@dataclass(frozen=True)
class Request:
    """What a run needs, read from the scene."""

    sketch: Handle
    others: tuple[Handle, ...]
    splash: Handle | None
    liquid: str  # identifier of the liquid that the splash stores now, "" for none
    layer: str
    drawings: list[Drawing]
    warnings: list[str]
    settings: SplashSettings
    frame: Frame | None
    frame_real_size: float
    moved: np.ndarray  # (4, 4), how the strokes moved in drawing space since the last run
    weights: Path | None
    last_weights: str  # hash of the weights of the last run, "" if there was none
    device: str
    precision: str  # number format to compute in; "": measure the fastest
    refinements: list[RefinementSettings]
    start: tuple[RefinementSettings, ...]  # those that a new splash is refined by afterwards
    obstacles: list[Obstacle]
    clearance: float
    may_refit: bool  # whether a new frame is fitted where the strokes have left the stored one
    look: looks.WantedLook

    @property
    def digest(self) -> str:
        """Identifies strokes, settings, obstacles and weights."""
        found = hashlib.sha256()
        for drawing in self.drawings:
            parts = (drawing.points, drawing.times, drawing.pressures, drawing.speeds)
            # Not where there are none, so that splashes of older files are still known.
            for values in parts if drawing.factors is None else (*parts, drawing.factors):
                found.update(b"none" if values is None else np.ascontiguousarray(values).tobytes())
        around = obstacles_key(self.obstacles, self.clearance) if self.obstacles else ()
        found.update(f"{self.settings!r} {around!r} {self.weights}".encode())
        return found.hexdigest()[:16]

    @property
    def key(self) -> tuple[object, ...]:
        """Identifies the run: equal keys, equal results, and an equal splash to write them to."""
        lists = repr((self.refinements, self.start))
        return self.splash, self.liquid, self.digest, lists, self.precision, self.look


@dataclass(frozen=True)
class Result:
    """What a run makes, ready to be written into the scene."""

    mesh: Mesh
    drops: Drops | None
    frame: Frame
    liquid: bytes
    weights_hash: str
    precision: str
    device: str
    summary: str
    warnings: list[str]
    fastest: float  # m/s, that the generator knows
    regime: str  # what is computed instead, where it knows no splash of this size
    attributes: Attributes | None = None


def snapshot(
    context: bpy.types.Context,
    target: Target,
    settings: SplashSettings,
    realign: bool = False,
    may_refit: bool = False,
    start: str = "",
) -> Request:
    """Read what a run needs.

    realign : fit a new local frame instead of the stored one; may_refit : only where the strokes
    have left that; start : what a new splash starts with, by default what its scene says.
    Raises StrokeError for strokes that no splash can be made of, SceneError where the result
    could not be computed or written.
    """
    dependencies.check()
    compile_ahead.want()
    context.view_layer.update()  # world matrices after moves by script
    sketch, splash, layer, others = target
    if splash is not None:
        check_writable(splash)
        layer = splash.splash.layer
    if sketch.type != "GREASEPENCIL":
        layer = ""
    if layer and layer not in sketch.data.layers:
        raise SceneError(lost_layer(layer, sketch))
    drawings, warnings = read_sketch((sketch, *others), layer, settings.use_modifiers)
    if not drawings and warnings:
        raise StrokeError(f"No stroke is left to make a splash of. {warnings[0]}")
    drawings, _, left_out = usable_drawings(drawings)
    warnings += [f"{warning}: Select Strokes shows them" for warning in left_out]
    warnings += targets.lost_objects(splash, others)
    record = splash.splash if splash is not None else None
    obstacles, clearance, no_obstacles = [], 0.0, []
    if splash is not None:
        obstacles, clearance, no_obstacles = obstacles_of(splash)
    warnings += no_obstacles
    device = device_for(context, settings.device)
    frame, moved = None, np.eye(4)
    if splash is not None:
        strokes = stored_liquid.strokes_of(splash.data)
        moved, _ = follow.strokes_moved(splash, sketch, strokes, drawings)
        frame = None if realign else kept_frame(record, moved)
    return Request(
        sketch=Handle.of(sketch),
        others=tuple(map(Handle.of, others)),
        splash=Handle.of(splash) if splash is not None else None,
        liquid=stored_liquid.identifier_of(splash.data) if splash is not None else "",
        layer=layer,
        drawings=drawings,
        warnings=warnings,
        settings=settings,
        frame=frame,
        frame_real_size=plain(record.frame_real_size) if record else 0.0,
        moved=moved,
        weights=weights_path(context),
        last_weights=record.weights_hash if record else "",
        precision=(record.precision if record else "") or known_precision(context, device),
        device=device,
        refinements=steps_of(splash) if splash is not None else [],
        start=starting_steps(context, start) if splash is None else (),
        obstacles=obstacles,
        clearance=clearance,
        may_refit=may_refit,
        look=looks.wanted_look(splash, settings),
    )


def kept_frame(record: Any, moved: np.ndarray) -> Frame | None:
    """Return the frame to keep, moved as its strokes were ``(4, 4)``.

    None where there is none, or where other strokes were chosen.
    """
    if not record.frame or record.refit:
        return None
    frame = frame_from_text(record.frame)
    return frame if np.array_equal(moved, np.eye(4)) else frame.moved(moved)


def lost_layer(layer: str, sketch: bpy.types.Object) -> str:
    """Return the message for a splash whose layer is gone."""
    return (
        f"Choose another layer in the Last Run panel: '{layer}' of '{sketch.name}' was deleted or "
        "renamed, so the splash stays"
    )


def found(sketch: Handle, splash: Handle | None, layer: str, others: tuple[Handle, ...]) -> Target:
    """Find what is meant again. Raises SceneError if some of it was deleted meanwhile."""
    items = sketch.find(), None if splash is None else splash.find()
    rest = tuple(handle.find() for handle in others)
    if items[0] is None or None in rest or (items[1] is None and splash is not None):
        raise SceneError("The sketch or its splash was deleted meanwhile, so nothing was made")
    return Target(items[0], items[1], layer, rest)


def check(
    handles: tuple[Handle, Handle | None, str, tuple[Handle, ...]],
    given: dict[str, Any],
    realign: bool,
    failed: str,
) -> None:
    """Raise ValueError while a splash that could not be made could not be made now either.

    failed : digest of what it could not be made of; "" where it could not be read
    """
    from ...core.pipeline import prepare_frame

    if not all(handle is None or handle.find() for handle in (*handles[:2], *handles[3])):
        return  # nobody misses it
    target = found(*handles)
    owner = bpy.context.scene if target.splash is None else target.splash
    settings = SplashSettings(**(vars(to_settings(owner.splash.settings)) | given))
    request = snapshot(bpy.context, target, settings, realign)
    frame = stored_frame(request)
    scale = frame.scale if frame is not None else None
    strokes, _ = strokes_from_drawings(request.drawings, settings, scale)
    prepare_frame(strokes, settings, frame)
    if failed and request.digest == failed:
        raise SceneError("Nothing has changed since it could not be made")


def compute(request: Request, report: Report) -> Result:
    """Make the splash, without bpy. Raises what core raises."""
    from ...core.obstacles import obstacles  # noqa: F401 - writing needs it: not to load it then
    from ...core.pipeline import fits, make_splash
    from ...core.refinement.stored_splash import StoredSplash

    start = time.perf_counter()
    settings = request.settings
    report = compile_ahead.started(bool(request.refinements), report)
    report("Reading the strokes", 0.0)
    frame = stored_frame(request)
    strokes, stroke_warnings = strokes_from_drawings(
        request.drawings, settings, frame.scale if frame is not None else None
    )
    if request.may_refit and frame is not None and not fits(strokes, frame, settings.real_size):
        frame = None
        strokes, stroke_warnings = strokes_from_drawings(request.drawings, settings)
    report("Loading the generator", 0.02)
    generator = loaded_generator.get(request.weights, request.device, request.precision)
    splash = make_splash(
        strokes, settings, generator, frame, part_of(report, 0.1, 0.9),
        for_liquid(request.refinements, settings.liquid), request.obstacles, request.clearance,
        looks.look_of_drawings(request.look, request.drawings),
    )  # fmt: skip
    report("Storing the liquid", 0.9)
    warnings = [*request.warnings, *stroke_warnings, *splash.warnings]
    warnings += generator_changes(request, generator.weights_hash, generator.precision)
    liquid = StoredSplash(splash.fields, splash.strokes, seed=settings.seed_of_details).to_bytes()
    seconds = time.perf_counter() - start
    return Result(
        mesh=splash.mesh.with_edges(),
        drops=splash.drops,
        frame=splash.frame,
        liquid=liquid,
        weights_hash=generator.weights_hash,
        precision=generator.precision,
        device=generator.device,
        summary=f"{len(splash.mesh.faces):,} faces in {seconds:.1f} s",
        warnings=list(dict.fromkeys(warnings)),
        fastest=float(generator.fastest),
        attributes=splash.attributes,
        regime=splash.regime,
    )


def generator_changes(request: Request, weights_hash: str, precision: str) -> list[str]:
    """Warn of a generator other than that of the last run: its weights, its number format."""
    warnings = []
    if request.last_weights not in ("", weights_hash):
        warnings.append("Made with another network than last time: the splash may look different")
    if request.precision not in ("", precision):
        warnings.append(
            f"Made in the format {precision}: {request.precision} is not available on this device. "
            "The splash may look a little different"
        )
    return warnings


class Framed(Protocol):
    """Drawings, and the frame that a splash of them was made in."""

    @property
    def drawings(self) -> Sequence[Drawing]: ...
    @property
    def settings(self) -> SplashSettings: ...
    @property
    def frame(self) -> Frame | None: ...
    @property
    def frame_real_size(self) -> float: ...


def stored_frame(request: Framed) -> Frame | None:
    """Return the frame of the last run, rescaled if the real size was changed since."""
    frame, real_size = request.frame, request.settings.real_size
    if frame is None or real_size == request.frame_real_size:
        return frame
    return replace(frame, scale=drawing_scale(request.drawings, real_size))


def write(context: bpy.types.Context, request: Request, result: Result) -> bpy.types.Object:
    """Write a result into the scene and return the splash object.

    Raises SceneError if the sketch or the splash was deleted while the result was computed.
    """
    sketch = request.sketch.find()
    splash = request.splash.find() if request.splash is not None else None
    if sketch is None or (splash is None and request.splash is not None):
        raise SceneError("The sketch or its splash was deleted meanwhile, so nothing was made")
    context.view_layer.update()
    if splash is not None:
        check_writable(splash)
        write_splash(context, splash, sketch, request, result)
    else:
        splash = mesh_object.new_object(context, sketch, request.layer)
        try:
            for other in filter(None, (handle.find() for handle in request.others)):
                splash.splash.others.add().sketch = other
            write_splash(context, splash, sketch, request, result)
            begin_list(splash, request.start)
        except BaseException:
            mesh_object.discard(splash)
            raise
        if sketch.mode == "OBJECT":  # else the artist goes on drawing
            select_only(context, splash)
    if request.precision != result.precision:
        keep_precision(context, request.device, result.precision)
    return splash


def write_splash(
    context: bpy.types.Context,
    splash: bpy.types.Object,
    sketch: bpy.types.Object,
    request: Request,
    result: Result,
) -> None:
    """Write a result into a splash object, on its sketch."""
    before = mesh_space.space_of(splash.data)
    space = before
    if splash.splash.version:
        space = follow.settle(splash, sketch, request.moved)
        if splash.parent is not None and splash.parent.type in STROKE_TYPES:
            if splash.parent not in (sketch, *others_of(splash)):
                follow.attach(splash, sketch)  # it followed the sketch that it was made of before
    elif context.scene.splash.follow:
        follow.attach(splash, sketch)
    lost = mesh_object.replace_mesh(splash, result.mesh, space, request.moved, result.attributes)
    follow.carry_owned(splash, before, space)
    drop_points.write(splash, result.drops)
    stored_liquid.write(splash.data, result.liquid)
    context.view_layer.update()
    with scheduler.held():  # what is noted here asks for no evaluation of its own
        remember(splash, sketch, request, replace(result, warnings=[*result.warnings, *lost]))
    motion.apply(splash)


def begin_list(splash: bpy.types.Object, steps: Sequence[RefinementSettings]) -> None:
    """Give a new splash its refinements. They follow by the queue: bare liquid is shown at once."""
    with scheduler.held():
        for step in steps:
            add_step(splash, step)


def remember(
    splash: bpy.types.Object, sketch: bpy.types.Object, request: Request, result: Result
) -> None:
    """Record on the splash how it was made."""
    record = splash.splash
    assign_settings(record.settings, request.settings)
    splash.splash_look.colours = looks.text_of(request.drawings)
    record.version = addon_version()
    record.made_of = splash.data.splash_liquid.made_of = request.digest
    record.made_with = repr(request.settings)
    record.made_threshold = request.settings.surface_threshold
    record.fastest, record.regime = result.fastest, result.regime
    record.frame, record.refit = frame_to_text(result.frame), False
    record.frame_real_size = request.settings.real_size
    record.weights_hash = result.weights_hash
    record.precision = result.precision
    record.device = result.device
    record.summary = result.summary
    record.warnings = "\n".join(result.warnings)
    follow.remember(splash, sketch)
    splash.splash_stack.flowed = ""
    refine.remember(splash, refine.task_of(splash).key, [], [])
