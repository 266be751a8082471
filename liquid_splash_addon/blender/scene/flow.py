# SPDX-License-Identifier: GPL-3.0-or-later
"""Flows that others have simulated: what an object shows at the current frame, with velocities."""

from __future__ import annotations

import hashlib
from typing import Any, NamedTuple

import bpy
import numpy as np

from ..data import index
from ..data.properties import plain
from .objects import SceneError
from .raw_strokes import read_attribute

VELOCITY = "velocity"

MANTAFLOW_UNIT = 0.16
"""Mantaflow's ``velocity`` is units per second of the liquid's own time, times this and the frame
rate, over the longest side of the domain."""


class Flow(NamedTuple):
    """Liquid with its velocity, in the world.

    Attributes
    ----------
    points : float64 ``(n, 3)``; velocities : float64 ``(n, 3)``, units per second of the liquid
    faces : ``(m, 3)`` indices; none for particles
    """

    points: np.ndarray
    faces: np.ndarray
    velocities: np.ndarray

    @property
    def key(self) -> str:
        """Identifies the flow."""
        found = hashlib.sha256()
        for values in self:
            found.update(np.ascontiguousarray(values).tobytes())
        return found.hexdigest()[:16]


def read_flow(context: bpy.types.Context, item: bpy.types.Object, time_scale: float) -> Flow:
    """Read what an object shows now, as its modifiers leave it.

    time_scale : seconds of the liquid's time in one of the scene's, backwards: velocities are
    divided by it.
    Raises SceneError where it shows no flow.
    """
    graph = context.evaluated_depsgraph_get()
    evaluated = item.evaluated_get(graph)
    if item.type == "POINTCLOUD":
        points, faces, velocities = read_points(evaluated.data)
    else:
        data = evaluated.to_mesh()
        try:
            points, faces, velocities = read_surface(data) if data else read_points(None)
        finally:
            evaluated.to_mesh_clear()
    if velocities is None or velocities.shape != points.shape:  # or of faces, or of corners
        raise SceneError(
            f"'{item.name}' has no attribute '{VELOCITY}' at this frame: choose a frame and an "
            "object with one, such as a baked liquid with Speed Vectors"
        )
    matrix = np.array(evaluated.matrix_world, dtype=np.float64)
    unit = velocity_unit(item, context.scene)
    turn = (
        matrix[:3, :3] if unit is None else np.array(evaluated.matrix_world.to_3x3().normalized())
    )
    return Flow(
        points @ matrix[:3, :3].T + matrix[:3, 3],
        faces,
        velocities @ turn.T * ((1.0 if unit is None else unit) / time_scale),
    )


def read_points(owner: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Read positions ``(n, 3)``, no faces, and velocities ``(n, 3)`` or None."""
    points = None if owner is None else read_attribute(owner, "position")
    velocities = None if owner is None else read_attribute(owner, VELOCITY)
    nothing = np.zeros((0, 3))
    return nothing if points is None else points, nothing.astype(np.int32), velocities


def read_surface(data: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Read vertices ``(n, 3)``, triangles ``(m, 3)``, and velocities ``(n, 3)`` or None."""
    points, _, velocities = read_points(data)
    data.calc_loop_triangles()
    faces = np.empty((len(data.loop_triangles), 3), dtype=np.int32)
    data.loop_triangles.foreach_get("vertices", faces.ravel())
    return points, faces, velocities


def velocity_unit(item: bpy.types.Object, scene: bpy.types.Scene) -> float | None:
    """Return units per second of one unit of a Mantaflow domain's velocity; None for others."""
    domains = [m.domain_settings for m in item.modifiers if m.type == "FLUID"]
    if not any(domain is not None for domain in domains):
        return None
    rate = scene.render.fps / scene.render.fps_base
    # Its own box: what it shows, and so its dimensions, is the liquid.
    corners = read_attribute(item.data, "position")
    size = float((np.ptp(corners, axis=0) * np.abs(item.matrix_world.to_scale())).max())
    return size / (MANTAFLOW_UNIT * rate)


def own_time_scale(item: bpy.types.Object) -> float:
    """Return the time scale of one of our splashes, models and simulations; 1 for other objects."""
    for splash in (*index.splashes(), *index.models()):
        record = splash.splash_simulation
        if item in (splash, record.motion, record.drops):
            return float(plain(splash.splash_motion.time_scale))
    return 1.0
