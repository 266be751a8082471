# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast a splash or a model moves: its scale, its velocities and its ballistic preview.

Meshes and drops are written in real time. :func:`apply` slows them down, live, whenever the time
scale changes; nothing is generated or refined for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import bpy
import numpy as np

from ...core.scale import Scale
from ...core.settings import MotionSettings
from ..data import revisions
from ..data.frame_text import frame_from_text
from ..data.look import METRES
from ..data.model import is_model, splashes_in
from ..data.properties import is_splash, plain, to_settings
from . import ballistics, drop_points, mesh_space
from .mesh_object import flat
from .model_parts import place_in
from .objects import Handle


class Unslowed(NamedTuple):
    """The velocities of a mesh whose time scale was changed.

    Without them each change, of which dragging a slider makes hundreds, would round once more.

    Attributes
    ----------
    written : float32, as they are in the mesh
    real : float64, in real time
    """

    written: np.ndarray
    real: np.ndarray


_unslowed: dict[int, Unslowed] = {}
"""Of the splash or model that was slowed down last and of its drops, by session_uid."""


_edited: set[Handle] = set()
"""Splashes and models whose velocities follow once they leave Edit Mode."""


def settings_of(item: bpy.types.Object) -> MotionSettings:
    """Read the motion of a splash or a model."""
    settings: MotionSettings = to_settings(item.splash_motion, MotionSettings)
    return settings


def scale_of(item: bpy.types.Object) -> Scale | None:
    """Return the scale of a splash or a model in slow motion; None before it was ever made.

    By it positions, velocities, gravity and times of the item's own space are turned into the
    liquid's. A model has that of its finest splash.
    """
    found = real_scale(item)
    return None if found is None else found.slowed(plain(item.splash_motion.time_scale))


def real_scale(item: bpy.types.Object) -> Scale | None:
    """Return the scale of a splash or a model in real time; None before it was ever made."""
    if not is_model(item):
        text = item.splash.frame
        return frame_from_text(text).scale if text else None
    scales = []
    for splash in splashes_in(item):
        if scale := real_scale(splash):
            size = float(np.cbrt(abs(np.linalg.det(place_in(item, splash)[:3, :3]))))
            scales.append(scale.resized(size))
    return max(scales, key=lambda scale: scale.length, default=None)


def movers_of(item: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """Yield the objects that move as one: the splash or model, and its drops."""
    yield item
    if drops := drop_points.own_points(item):
        yield drops


def apply(item: bpy.types.Object) -> None:
    """Make velocities and ballistic preview of a splash or a model follow its settings."""
    if not (is_splash(item) or is_model(item)):
        return
    time_scale = plain(item.splash_motion.time_scale)
    if any(mover.mode == "EDIT" for mover in movers_of(item)):
        _edited.add(Handle.of(item))
    mark_metres(item)
    meshes = [mover.data for mover in movers_of(item) if can_follow(mover)]
    for uid in _unslowed.keys() - {mesh.session_uid for mesh in meshes}:
        del _unslowed[uid]
    for mesh in meshes:
        slow_down(mesh, time_scale)
    if ballistics.modifier_of(item) is not None:
        preview(item)


def mark_metres(item: bpy.types.Object) -> None:
    """Note on a splash or a model and its drops how large they are, for shaders."""
    scale = real_scale(item)
    if scale is None:
        return
    space = mesh_space.space_of(item.data)
    size = float(np.cbrt(abs(np.linalg.det(space[:3, :3]))))
    for mover in movers_of(item):  # drops are in drawing space
        metres = scale.length / max(size, 1e-12) if mover == item else scale.length
        if mover.is_editable and abs(mover.get(METRES, 0.0) - metres) > 1e-6 * metres:
            mover[METRES] = metres


def can_follow(mover: bpy.types.Object) -> bool:
    """Whether velocities can be written: not in Edit Mode, nor in a linked mesh."""
    return bool(mover.mode != "EDIT" and mover.is_editable and mover.data.is_editable)


def slow_down(mesh: bpy.types.Mesh, time_scale: float) -> None:
    """Write the velocities of ``mesh`` at ``time_scale``."""
    record, velocity = mesh.splash_liquid, mesh.attributes.get("velocity")
    before = plain(record.time_scale)
    if before == time_scale:
        return
    record.time_scale = time_scale
    if not record.is_property_set("content"):
        # glTF leaves out groups that hold bytes, also empty ones; others it writes.
        record.content = b""
    if velocity is None or not len(velocity.data):
        return
    written = np.empty(3 * len(velocity.data), dtype=np.float32)
    velocity.data.foreach_get("vector", written)
    known = _unslowed.get(mesh.session_uid)
    if known is None or not np.array_equal(known.written, written):
        known = Unslowed(written, written.astype(np.float64) / before)
    slowed = flat(known.real * time_scale)
    velocity.data.foreach_set("vector", slowed)
    mesh.update()
    _unslowed[mesh.session_uid] = Unslowed(slowed, known.real)


def preview(item: bpy.types.Object) -> None:
    """Let a splash or a model and its drops fly on over the timeline, or fly as they should now."""
    settings, scale, render = settings_of(item), scale_of(item), bpy.context.scene.render
    gravity = 0.0 if scale is None else settings.gravity * scale.gravity
    for mover in movers_of(item):
        if mover.is_editable:
            ballistics.set_motion(
                ballistics.ensure(mover),
                settings.shape_frame,
                gravity,
                render.fps / render.fps_base,
            )


def end_preview(item: bpy.types.Object) -> None:
    """Have a splash or a model and its drops stand still again."""
    for mover in movers_of(item):
        ballistics.remove(mover)


@bpy.app.handlers.persistent
def notice_modes(_scene: Any, _graph: Any = None) -> None:
    """Go on with what was in Edit Mode; this costs nothing where nothing was."""
    if _edited and not bpy.app.is_job_running("RENDER"):
        waiting = {handle: handle.find() for handle in _edited}
        _edited.clear()
        for item in waiting.values():
            if item is not None:
                apply(item)  # which comes back here if it is in Edit Mode still


def register() -> None:
    """Follow every change of the motion's settings."""
    revisions.listen(apply, revisions.MOTION)
    bpy.app.handlers.depsgraph_update_post.append(notice_modes)


def unregister() -> None:
    """Stop following."""
    bpy.app.handlers.depsgraph_update_post.remove(notice_modes)
    revisions.ignore(apply, revisions.MOTION)
    _edited.clear()
    _unslowed.clear()
