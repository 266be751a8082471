# SPDX-License-Identifier: GPL-3.0-or-later
"""A splash for each layer of a sketch: only those whose layer has changed are made anew."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy

from ...core.settings import SplashSettings
from ...core.sketch.strokes import StrokeError
from ..data.model import models_of
from ..data.properties import to_settings
from ..scene import mesh_object, model_parts
from ..scene.grease_pencil import drawn_layers
from ..scene.objects import SceneError, by_uid, select_only
from ..scene.targets import Target, splashes_of
from . import generate, scheduler

if TYPE_CHECKING:
    from ...core.pipeline import Report

Choose = Callable[[SplashSettings], SplashSettings]


@dataclass(frozen=True)
class LayersRequest:
    """What there is to do, read from the scene.

    Attributes
    ----------
    sketch : session_uid
    runs : of the layers that have changed
    kept : number of splashes that are as their layers are
    warnings : sentences for the user
    """

    sketch: int
    runs: list[generate.Request]
    kept: int
    warnings: list[str]


def snapshot(context: bpy.types.Context, sketch: bpy.types.Object, choose: Choose) -> LayersRequest:
    """Read the visible layers of ``sketch`` that have strokes.

    choose : returns the settings to use for stored ones. Raises SceneError, StrokeError where
    nothing can be made of any layer.
    """
    own = {item.splash.layer: item for item in splashes_of(sketch, context.scene)}
    layers = drawn_layers(sketch)
    if not layers:
        raise SceneError(f"'{sketch.name}' has no visible layer with strokes: draw some first")
    runs, kept, warnings = [], 0, deleted(sketch, own)
    for layer in layers:
        splash = own.get(layer)
        owner = context.scene if splash is None else splash
        settings = choose(to_settings(owner.splash.settings))
        try:
            request = generate.snapshot(context, Target(sketch, splash, layer), settings)
        except (StrokeError, SceneError) as error:
            warnings.append(f"Layer '{layer}': {error}")
            continue
        if splash is not None and splash.splash.made_of == request.digest:
            kept += 1
        else:
            runs.append(request)
    if not runs and not kept:
        raise SceneError(" / ".join(warnings))
    return LayersRequest(sketch.session_uid, runs, kept, warnings)


def deleted(sketch: bpy.types.Object, own: dict[str, bpy.types.Object]) -> list[str]:
    """Return a warning for each splash whose layer is gone; the splash keeps it, too."""
    warnings = []
    for layer, splash in own.items():
        if layer and layer not in sketch.data.layers:
            warnings.append(generate.lost_layer(layer, sketch))
            splash.splash.warnings = warnings[-1]
    return warnings


def compute(request: LayersRequest, report: Report) -> list[generate.Result | StrokeError]:
    """Make the splashes one after the other; no bpy here. A layer's own fault is its result."""
    results: list[generate.Result | StrokeError] = []
    for number, run in enumerate(request.runs):
        part = generate.part_of(
            report, number / len(request.runs), (number + 1) / len(request.runs)
        )
        try:
            results.append(generate.compute(run, labelled(part, run.layer)))
        except StrokeError as error:
            results.append(error)
    return results


def labelled(report: Report, layer: str) -> Report:
    """Return a report that names the layer."""
    return lambda stage, share: report(f"{layer}: {stage}", share)


def write(
    context: bpy.types.Context,
    request: LayersRequest,
    results: list[generate.Result | StrokeError],
) -> list[str]:
    """Write the splashes, join them if there are several, and return warnings.

    Raises SceneError if the sketch went away meanwhile or nothing could be made.
    """
    warnings = list(request.warnings)
    made = 0
    with scheduler.held():
        for run, result in zip(request.runs, results, strict=True):
            if isinstance(result, StrokeError):
                warnings.append(f"Layer '{run.layer}': {result}")
                continue
            generate.write(context, run, result)
            warnings += (f"Layer '{run.layer}': {warning}" for warning in result.warnings)
            made += 1
        if not made and not request.kept:
            raise SceneError(" / ".join(warnings))
        sketch = by_uid(request.sketch)
        if sketch is None:
            raise SceneError("The sketch was deleted meanwhile")
        stay_with(sketch, context)
        model = join(context, sketch)
    if model is not None:
        warnings += filter(None, model.splash_model.warnings.split("\n"))
    return warnings


def stay_with(sketch: bpy.types.Object, context: bpy.types.Context) -> None:
    """Move the splashes that were not made anew as the sketch has moved."""
    for splash in splashes_of(sketch, context.scene):
        mesh_object.follow_sketch(splash, sketch)
        context.view_layer.update()
        mesh_object.remember_place(splash, sketch)


def join(context: bpy.types.Context, sketch: bpy.types.Object) -> bpy.types.Object | None:
    """Put the splashes of the layers into the sketch's model; a new one if there are several."""
    splashes = [item for item in splashes_of(sketch, context.scene) if item.splash.layer]
    found = [model for splash in splashes for model in models_of(splash)]
    free = [splash for splash in splashes if not models_of(splash)]
    if found:
        model_parts.add_parts(found[0], free)
        scheduler.request(found[0])
        return found[0]
    if len(free) > 1:
        model = model_parts.new_model(context, free)
        if sketch.mode == "OBJECT":  # else leave the artist in the middle of the drawing
            select_only(context, model)
        return model
    return None
