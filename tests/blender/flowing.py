# SPDX-License-Identifier: GPL-3.0-or-later
"""Liquids with known flows for Blender's own solver, and what the tests measure on its frames."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from liquid_splash_addon.blender.jobs import bake_mantaflow, export_mantaflow
from liquid_splash_addon.blender.scene import fluid_domain
from liquid_splash_addon.core.animation.solver_start import SolverStart
from liquid_splash_addon.core.composition.drops import Drops
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.level_set import LevelSet
from liquid_splash_addon.core.mantaflow.cache_files import read_particles
from liquid_splash_addon.core.mantaflow.comparison import Comparison, compare
from liquid_splash_addon.core.mantaflow.settings import MantaflowSettings
from liquid_splash_addon.core.progress import silent
from liquid_splash_addon.core.scale import Scale
from liquid_splash_addon.core.sketch.local_frame import Frame

SPACING = 0.003
LENGTH = 0.16
"""Metres per Blender unit."""

TURN = 40.0
"""Of the turning flow, rad/s."""


def centres(cells: int = 64) -> tuple[Grid, np.ndarray]:
    """Return a grid around the origin, metres, and the centres of its cells ``(X, Y, Z, 3)``."""
    half = cells * SPACING / 2
    grid = Grid((cells,) * 3, SPACING, (-half, -half, -half))
    return grid, grid.centres().astype(np.float64)


def body(away: np.ndarray, flow: np.ndarray, grid: Grid, time: float = 1.0, turn=None):
    """Return the start of a liquid: signed distance (m) and velocity ``(X, Y, Z, 3)`` (m/s)."""
    level = np.clip(away / SPACING, -3, 3).astype(np.float32)
    velocity = np.moveaxis(flow, -1, 0).astype(np.float32) * (level < 3)
    none = np.zeros((0, 3), dtype=np.float32)
    frame = Frame(np.eye(3) if turn is None else turn, np.zeros(3), Scale(LENGTH, time))
    drops = Drops(none, none, none[:, 0], np.zeros(0, dtype=bool))
    return SolverStart(LevelSet(level, velocity, grid), drops, frame, frame)


def ball(flow, radius: float = 0.06, shell: float = 0.0, **more) -> SolverStart:
    """Return a ball of liquid, or a shell of that thickness (m); flow : a function of points."""
    grid, points = centres()
    away = np.linalg.norm(points, axis=-1) - radius
    return body(np.abs(away) - shell / 2 if shell else away, flow(points), grid, **more)


def crown(speed: float, time: float) -> SolverStart:
    """Return a ring-shaped wall that rises and spreads at ``speed``, m/s."""
    grid, points = centres()
    around = np.linalg.norm(points[..., :2], axis=-1)
    wall = np.abs(around - 0.05) - 0.006
    away = np.maximum(wall, np.abs(points[..., 2]) - 0.035)
    outward = points * (1, 1, 0) / np.maximum(around, 1e-6)[..., None]
    return body(away, speed * (outward * 0.6 + (0, 0, 1)), grid, time)


def uniform(points: np.ndarray) -> np.ndarray:
    """Return a flow that is the same everywhere."""
    return np.broadcast_to((0.8, -0.5, 1.1), points.shape)


def turning(points: np.ndarray) -> np.ndarray:
    """Return a flow that turns about a slanted axis."""
    return np.cross(np.array([0.3, 0.5, 0.8]) * TURN, points)


def curling(points: np.ndarray) -> np.ndarray:
    """Return the ABC flow, which is its own curl."""
    x, y, z = np.moveaxis(points * 30, -1, 0)
    flow = [np.sin(z) + np.cos(y), np.sin(x) + np.cos(z), np.sin(y) + np.cos(x)]
    return np.stack(flow, axis=-1)


def exported(start: SolverStart, cache: Path, fps: float = 24, **settings) -> bpy.types.Object:
    """Export a start, whatever it was made of, and return its domain."""
    scene = bpy.context.scene
    scene.render.fps = int(fps)
    source = bpy.data.objects.new("Source", bpy.data.meshes.new("Source"))
    scene.collection.objects.link(source)
    chosen = MantaflowSettings(**{"resolution": 32, "mesh": False, **settings})
    task = export_mantaflow.ExportTask(
        None, chosen, fps, np.array([0.0, 0.0, -1.0]), 200 * 9.81, cache, str(cache), False
    )  # type: ignore[arg-type]
    made = export_mantaflow.stage(task, start, silent)
    return export_mantaflow.write(bpy.context, task, made, source)


def baked(item: bpy.types.Object) -> Path:
    """Bake a domain, whatever it was made of, and return its cache."""
    bpy.context.view_layer.objects.active = item
    assert bpy.ops.fluid.bake_data() == {"FINISHED"}
    assert bake_mantaflow.last_frame(item) == fluid_domain.settings_of(item).cache_frame_end
    return bake_mantaflow.cache_of(item)


def compared(item: bpy.types.Object) -> Comparison:
    """Bake a domain and compare its first solved frame."""
    cache, group = baked(item), item.splash_domain
    return compare(cache, group.frame, fluid_domain.gravity_vector(bpy.context.scene, group.fall))


def mean_place(item: bpy.types.Object, frame: int) -> np.ndarray:
    """Return the mean place of the particles of a frame, units, from the domain's corner."""
    cell = max(item.dimensions) / fluid_domain.settings_of(item).resolution_max
    positions, _ = read_particles(bake_mantaflow.cache_of(item), frame)
    return positions.astype(np.float64).mean(axis=0) * cell


def mean_radius(item: bpy.types.Object, frame: int) -> float:
    """Return the mean distance of a frame's particles from its upright middle axis, units."""
    cell = max(item.dimensions) / fluid_domain.settings_of(item).resolution_max
    positions, _ = read_particles(bake_mantaflow.cache_of(item), frame)
    middle = np.array([*item.dimensions])[:2] / cell / 2
    return float(np.linalg.norm(positions[:, :2] - middle, axis=1).mean() * cell)
