# SPDX-License-Identifier: GPL-3.0-or-later
"""A splash for each layer of a sketch; only those whose layer has changed are made again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import bpy

from ...core.settings import SplashSettings
from ...core.sketch.strokes import StrokeError
from ..data.model import models_of
from ..data.properties import to_settings
from ..scene import evaluated, follow, mesh_object, model_parts
from ..scene.grease_pencil import drawn_layers
from ..scene.objects import Handle, SceneError, select_only
from ..scene.targets import Target, splashes_of
from . import generate, scheduler
from .progress import labelled, part_of

if TYPE_CHECKING:
    from ...core.progress import Report

Choose = Callable[[SplashSettings], SplashSettings]


@dataclass(frozen=True)
class LayersRequest:
    """What is to be made, read from the scene.

    Attributes
    ----------
    sketch : the object with the layers
    runs : one for each layer that has changed
    kept : number of splashes that are up to date
    warnings : sentences for the user
    """

    sketch: Handle
    runs: list[generate.Request]
    kept: int
    warnings: list[str]

    @property
    def key(self) -> tuple[object, ...]:
        """Identifies the runs: equal keys, equal results."""
        return tuple(run.key for run in self.runs)


def snapshot(context: bpy.types.Context, sketch: bpy.types.Object, choose: Choose) -> LayersRequest:
    """Read the visible layers of ``sketch`` that have strokes.

    choose : turns the stored settings of a splash into those to use
    Raises SceneError if no splash can be made of any layer.
    """
    own = {item.splash.layer: item for item in splashes_of(sketch, context.scene)}
    layers = drawn_layers(sketch)
    if not layers:
        raise SceneError(f"'{sketch.name}' has no visible layer with strokes: draw one first")
    runs, kept, warnings = [], 0, warn_of_lost_layers(sketch, own)
    for layer in layers:
        splash = own.get(layer)
        owner = context.scene if splash is None else splash
        settings = choose(to_settings(owner.splash.settings))
        try:
            request = generate.snapshot(context, Target(sketch, splash, layer), settings)
        except (StrokeError, SceneError) as error:
            warnings.append(f"Layer '{layer}': {error}")
            continue
        if splash is not None and evaluated.is_made_of(splash, request.digest):
            kept += 1
        else:
            runs.append(request)
    if not runs and not kept:
        raise SceneError(" / ".join(warnings))
    return LayersRequest(Handle.of(sketch), runs, kept, warnings)


def warn_of_lost_layers(sketch: bpy.types.Object, own: dict[str, bpy.types.Object]) -> list[str]:
    """Return a warning for each splash whose layer is gone, and record it on the splash."""
    warnings = []
    for layer, splash in own.items():
        if layer and layer not in sketch.data.layers:
            warnings.append(generate.lost_layer(layer, sketch))
            splash.splash.warnings = warnings[-1]
    return warnings


def compute(request: LayersRequest, report: Report) -> list[generate.Result | StrokeError]:
    """Make the splashes one by one, without bpy; a StrokeError is the result of its layer."""
    results: list[generate.Result | StrokeError] = []
    for number, run in enumerate(request.runs):
        part = part_of(report, number / len(request.runs), (number + 1) / len(request.runs))
        try:
            results.append(generate.compute(run, labelled(part, run.layer)))
        except StrokeError as error:
            results.append(error)
    return results


def write(
    context: bpy.types.Context,
    request: LayersRequest,
    results: list[generate.Result | StrokeError],
) -> list[str]:
    """Write the splashes, join them if there are several, and return warnings.

    Raises SceneError if the sketch was deleted meanwhile, or no splash could be made.
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
        sketch = request.sketch.find()
        if sketch is None:
            raise SceneError("The sketch was deleted meanwhile, so its splashes were not joined")
        move_with_sketch(sketch, context)
        model = join(context, sketch)
    if model is not None:
        warnings += filter(None, model.splash_model.warnings.split("\n"))
    return warnings


def move_with_sketch(sketch: bpy.types.Object, context: bpy.types.Context) -> None:
    """Move all splashes of ``sketch`` as it has moved, also those that were not made again."""
    for splash in splashes_of(sketch, context.scene):
        mesh_object.respace(splash.data, follow.settle(splash, sketch))
        follow.remember(splash, sketch)


def join(context: bpy.types.Context, sketch: bpy.types.Object) -> bpy.types.Object | None:
    """Add the splashes of the layers to their model, or make one if there are several.

    Returns None for a single splash without a model.
    """
    splashes = [item for item in splashes_of(sketch, context.scene) if item.splash.layer]
    found = [model for splash in splashes for model in models_of(splash)]
    free = [splash for splash in splashes if not models_of(splash)]
    if found:
        model_parts.add_parts(found[0], free)
        scheduler.request(found[0])
        return found[0]
    if len(free) > 1:
        model = model_parts.new_model(context, free)
        if sketch.mode == "OBJECT":  # else the artist goes on drawing
            select_only(context, model)
        return model
    return None
