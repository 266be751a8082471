# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast the liquid flows along the strokes of the active sketch, for the overlay.

Found out by the queue, as it fits a frame to the strokes; what is shown is that of a moment ago.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
import numpy as np

from ...core.settings import SplashSettings
from ...core.sketch.drawing import Drawing, strokes_from_drawings, usable_drawings
from ...core.sketch.local_frame import Frame, fit_frame
from ..data import stored_liquid
from ..data.preferences import weights_path
from ..data.properties import plain, to_settings
from ..scene import follow, places
from ..scene.stroke_objects import read_sketch
from ..scene.targets import Target, find_target
from . import generate, work_queue
from .work_queue import Entry, Work

if TYPE_CHECKING:
    from ...core.progress import Report


class Line(NamedTuple):
    """A stroke as the generator takes it.

    points : float64 ``(n, 3)`` in the world; speeds : of the liquid, ``(n,)``, m/s; faults : what
    is outside the range of training, bits ``(n,)``, see core.condition.trained_range
    """

    points: np.ndarray
    speeds: np.ndarray
    faults: np.ndarray


class SpeedMap(NamedTuple):
    """All strokes of a sketch; fastest : speed up to which the generator was trained, m/s."""

    sketch: int
    lines: list[Line]
    fastest: float


@dataclass(frozen=True)
class Question:
    """What a map is made of, read from the scene; the names are those of generate.Request."""

    sketch: int
    drawings: list[Drawing]
    settings: SplashSettings
    frame: Frame | None
    frame_real_size: float
    matrix: np.ndarray
    weights: Path | None


_map: SpeedMap | None = None
_is_stale = True
_is_asked = False
_seen: tuple[object, ...] = ()
_listeners: list[Callable[[], None]] = []


def current(context: bpy.types.Context) -> SpeedMap | None:
    """Return the map of the active sketch as it was a moment ago; None as long as there is none."""
    global _is_asked, _is_stale, _seen
    target = find_target(context)
    if target is None or context.active_object != target.sketch:
        return None
    token = token_of(target, context)
    if token != _seen:
        _seen, _is_stale = token, True
    if _is_stale and not _is_asked and not work_queue.is_immediate():
        _is_asked, _is_stale = True, False
        work_queue.put(Entry(0, read, fail))
    return _map if _map is not None and _map.sketch == target.sketch.session_uid else None


def token_of(target: Target, context: bpy.types.Context) -> tuple[object, ...]:
    """Return what is cheap to read and decides on the map, beside the strokes."""
    owner = target.splash or context.scene
    frame = target.splash.splash.frame if target.splash is not None else ""
    return target.sketch.session_uid, to_settings(owner.splash.settings), frame


def ask(context: bpy.types.Context) -> Question | None:
    """Read what the map is made of; None where there are no strokes."""
    target = find_target(context)
    if target is None:
        return None
    record = None if target.splash is None else target.splash.splash
    owner = target.splash or context.scene
    settings = to_settings(owner.splash.settings)
    objects = (target.sketch, *target.others)
    drawings, _ = read_sketch(objects, target.layer, settings.use_modifiers)
    if not drawings:
        return None
    return Question(
        target.sketch.session_uid,
        drawings,
        settings,
        None if target.splash is None else kept_frame(target.splash, target.sketch, drawings),
        plain(record.frame_real_size) if record else 0.0,
        np.array(places.rigid_matrix(target.sketch), dtype=np.float64),
        weights_path(context),
    )


def kept_frame(
    splash: bpy.types.Object, sketch: bpy.types.Object, drawings: list[Drawing]
) -> Frame | None:
    """Return the frame that the splash would be made again in, moved as its strokes were."""
    strokes = stored_liquid.strokes_of(splash.data)
    moved, _ = follow.strokes_moved(splash, sketch, strokes, drawings)
    return generate.kept_frame(splash.splash, moved)


def read() -> Work:
    """Read the work from the scene as it is now."""
    global _is_asked
    _is_asked = False
    question = ask(bpy.context)
    if question is None:
        return Work("nothing", lambda _report: None, keep)
    # Strokes that were changed meanwhile make the map stale, so they need not be in the key.
    key = (question.sketch, question.settings)
    return Work(key, lambda report: compute(question, report), keep)


def compute(question: Question, report: Report) -> SpeedMap:
    """Make the map, without bpy. Raises StrokeError where no stroke can be used."""
    from ...core.condition.similarity import model_scale
    from ...core.condition.trained_range import faults_of, measured

    report("Measuring strokes", 0.0)
    drawings, _, _ = usable_drawings(question.drawings)
    frame = generate.stored_frame(question)
    scale = None if frame is None else frame.scale
    strokes, _ = strokes_from_drawings(drawings, question.settings, scale)
    frame = frame or fit_frame(strokes, question.settings.real_size)
    local = frame.strokes_to_local(strokes, question.settings.speed_gain)
    model, fastest = model_scale(local), fastest_of(question.weights)
    seen = frame.seen_as(model)
    turn, shift = question.matrix[:3, :3].T, question.matrix[:3, 3]
    lines = []
    for stroke, measures in measured(seen.strokes_to_local(strokes, question.settings.speed_gain)):
        points = seen.points_to_drawing(stroke.points.astype(np.float64)) @ turn + shift
        speeds = model.velocities_to_drawing(measures.speed)
        lines.append(Line(points, speeds, faults_of(measures, fastest)))
    return SpeedMap(question.sketch, lines, model.velocities_to_drawing(fastest))


def fastest_of(weights: Path | None) -> float:
    """Return the speed up to which a generator was trained, m/s. Raises WeightsError."""
    from ...core.generator.weights_file import default_weights_path

    path = weights or default_weights_path()
    return _fastest(path, path.stat().st_mtime_ns if path.is_file() else 0)


@lru_cache(maxsize=4)
def _fastest(path: Path, _changed: int) -> float:
    from ...core.generator.weights_file import read_file, read_header

    return float(read_header(read_file(path), path)["fastest"])


def keep(found: SpeedMap | None) -> None:
    """Keep a map, to be shown from now on."""
    global _map
    _map = found
    for listener in _listeners:
        listener()


def fail(_error: Exception) -> None:
    """Show nothing where there is nothing to be shown: generating says why."""
    global _is_asked
    _is_asked = False
    keep(None)


def listen(listener: Callable[[], None]) -> None:
    """Call ``listener`` whenever there is another map."""
    _listeners.append(listener)


@bpy.app.handlers.persistent
def notice(_scene: Any = None, graph: Any = None) -> None:
    """Make the map stale where anything of a sketch was changed."""
    global _is_stale
    if _is_stale or (graph is not None and not changes_strokes(graph.updates)):
        return
    _is_stale = True


def changes_strokes(updates: Sequence[Any]) -> bool:
    """Whether an update of the scene may have changed strokes or the place of an object."""
    names = {type(update.id).__name__ for update in updates}
    return bool(names & {"Object", "GreasePencil", "GreasePencilv3", "Curve", "Curves"})


@bpy.app.handlers.persistent
def forget(_file: object = None, _unused: object = None) -> None:
    """Forget all: another file is opened."""
    global _map, _is_asked, _is_stale, _seen
    _map, _is_asked, _is_stale, _seen = None, False, True, ()


def handlers() -> list[tuple[Any, Any]]:
    """Pair each list of handlers in Blender with the function to add to it."""
    known = bpy.app.handlers
    return [
        (known.depsgraph_update_post, notice),
        (known.undo_post, notice),
        (known.redo_post, notice),
        (known.frame_change_post, notice),
        (known.load_pre, forget),
    ]


def register() -> None:
    """Listen to changes."""
    for known, handler in handlers():
        known.append(handler)


def unregister() -> None:
    """Stop listening, and forget all."""
    for known, handler in handlers():
        known.remove(handler)
    _listeners.clear()
    forget()
