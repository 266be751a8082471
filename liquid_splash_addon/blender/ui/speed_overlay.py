# SPDX-License-Identifier: GPL-3.0-or-later
"""An overlay on strokes: colours and arrows of the liquid's speed, and where it is out of range."""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy
import numpy as np
from bpy.props import BoolProperty

from ...core.condition.trained_range import FAST, LONELY, OUTSIDE, SHARP, in_words
from ...core.sketch.arrows import arrowheads
from ...core.sketch.speed_colours import FAST as END_OF_RAMP
from ...core.sketch.speed_colours import RAMP, colours_of
from ..jobs import speed_map
from ..jobs.speed_map import SpeedMap
from .viewport_text import lower_edge, write

WARNING = (1.0, 0.0, 0.75, 1.0)
"""Where strokes leave the range of training: no colour of the ramp."""

WIDTH, ARROW_WIDTH = 3.0, 2.0
"""Of lines, in pixels at scale 1."""

ARROW = 0.02
"""Length of arrowheads over the size of the sketch."""

BAR, ABOVE, LEFT, LETTERS = (160, 10), 70, 70, 11
"""Legend: width and height of the ramp, its place from the lower left corner, height of letters."""


class Geometry(NamedTuple):
    """Line segments in the world, two points each, with colours ``(m, 4)``, and for the legend, how
    many strokes have each fault, by its bit."""

    lines: np.ndarray
    line_colours: np.ndarray
    arrows: np.ndarray
    arrow_colours: np.ndarray
    faulty: dict[int, int]


def geometry_of(found: SpeedMap) -> Geometry:
    """Return what is drawn of a map."""
    everything = np.concatenate([line.points for line in found.lines])
    size = ARROW * float(np.ptp(everything, axis=0).max())
    lines, line_colours, arrows, arrow_colours = [], [], [], []
    for line in found.lines:
        colours = colours_of(line.speeds * (END_OF_RAMP / found.fastest))
        colours[line.faults > 0] = WARNING
        lines.append(np.stack([line.points[:-1], line.points[1:]], axis=1).reshape(-1, 3))
        line_colours.append(np.stack([colours[:-1], colours[1:]], axis=1).reshape(-1, 4))
        heads = arrowheads(line.points, size)
        arrows.append(heads.segments.reshape(-1, 3))
        arrow_colours.append(np.repeat(colours[heads.nearest], 8, axis=0))
    bits = (FAST, SHARP, LONELY, OUTSIDE)
    faulty = {bit: sum(bool((line.faults & bit).any()) for line in found.lines) for bit in bits}
    return Geometry(
        *(np.concatenate(parts).astype(np.float32) for parts in
          (lines, line_colours, arrows, arrow_colours)),
        {bit: count for bit, count in faulty.items() if count},
    )  # fmt: skip


class Batches(NamedTuple):
    """What the graphics card was given of a map."""

    made_of: SpeedMap
    geometry: Geometry
    lines: Any
    arrows: Any


_batches: Batches | None = None


def batches_of(found: SpeedMap, shader: Any) -> Batches:
    """Return the batches of a map; they are made once."""
    global _batches
    from gpu_extras.batch import batch_for_shader

    if _batches is None or _batches.made_of is not found:
        shape = geometry_of(found)
        pairs = ((shape.lines, shape.line_colours), (shape.arrows, shape.arrow_colours))
        lines, arrows = (
            batch_for_shader(shader, "LINES", {"pos": points, "color": colours})
            for points, colours in pairs
        )
        _batches = Batches(found, shape, lines, arrows)
    return _batches


def shown(context: bpy.types.Context) -> SpeedMap | None:
    """Return what the overlay shows in this viewport; None for nothing."""
    if not context.window_manager.splash_show_speed or not context.space_data.overlay.show_overlays:
        return None
    found = speed_map.current(context)
    return found if found is not None and found.lines else None


def draw_strokes() -> None:
    """Draw lines and arrows in the scene; Blender calls this for each viewport."""
    import gpu

    context = bpy.context
    found = shown(context)
    if found is None:
        return
    shader = gpu.shader.from_builtin("POLYLINE_SMOOTH_COLOR")
    batches = batches_of(found, shader)
    scale = context.preferences.system.ui_scale
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("NONE")  # strokes are drawn over the splash
    shader.bind()
    shader.uniform_float("viewportSize", (context.region.width, context.region.height))
    for batch, width in ((batches.lines, WIDTH), (batches.arrows, ARROW_WIDTH)):
        shader.uniform_float("lineWidth", width * scale)
        batch.draw(shader)
    gpu.state.blend_set("NONE")


def draw_legend() -> None:
    """Draw what the colours mean into the lower left corner."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    context = bpy.context
    found = shown(context)
    if found is None:
        return
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    batches = batches_of(found, gpu.shader.from_builtin("POLYLINE_SMOOTH_COLOR"))
    scale = context.preferences.system.ui_scale
    raised = lower_edge(context)
    points, colours = ramp(scale, raised)
    batch_for_shader(shader, "TRI_STRIP", {"pos": points, "color": colours}).draw(shader)
    left, low, width = LEFT * scale, raised + ABOVE * scale, BAR[0] * scale
    size = LETTERS * scale
    for share in (0.0, 0.5, 1.0):
        text = f"{share * found.fastest:.1f}" + (" m/s" if share == 1 else "")
        write(text, (left + share * width - size / 2, low - 1.4 * size), size)
    for number, (bit, count) in enumerate(batches.geometry.faulty.items()):
        text = f"{count} stroke(s) {in_words(bit, found.fastest)}"
        above = low + BAR[1] * scale + (0.5 + 1.5 * number) * size
        write(text, (left, above), size, WARNING)


def ramp(scale: float, raised: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners ``(2 n, 3)`` of the legend's ramp in pixels, and their colours.

    raised : pixels that are covered below it
    """
    across = LEFT + BAR[0] * np.linspace(0, 1, len(RAMP))
    corners = [(x, y, 0.0) for x in across for y in (ABOVE, ABOVE + BAR[1])]
    colours = np.repeat(np.insert(np.array(RAMP), 3, 1.0, axis=1), 2, axis=0)
    placed = scale * np.array(corners) + (0.0, raised, 0.0)
    return placed.astype(np.float32), colours.astype(np.float32)


def redraw_views() -> None:
    """Have all 3D viewports drawn again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


_handlers: list[Any] = []


def register() -> None:
    """Add the switch and, where there is a window, the drawing."""
    bpy.types.WindowManager.splash_show_speed = BoolProperty(
        name="Show Speed",
        description="Show in the viewport how fast the liquid flows along the strokes and which "
        "way, and where they are outside what the generator was trained on",
        update=lambda _self, _context: redraw_views(),
    )
    speed_map.listen(redraw_views)
    if not bpy.app.background:
        for function, when in ((draw_strokes, "POST_VIEW"), (draw_legend, "POST_PIXEL")):
            handler = bpy.types.SpaceView3D.draw_handler_add(function, (), "WINDOW", when)
            _handlers.append(handler)


def unregister() -> None:
    """Remove both."""
    global _batches
    for handler in _handlers:
        bpy.types.SpaceView3D.draw_handler_remove(handler, "WINDOW")
    _handlers.clear()
    _batches = None
    del bpy.types.WindowManager.splash_show_speed
