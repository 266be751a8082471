# SPDX-License-Identifier: GPL-3.0-or-later
"""What the Blender tests draw with, and a generator that needs no training."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace

import bpy
import numpy as np
from mathutils import Matrix
from scipy.ndimage import distance_transform_edt, gaussian_filter, zoom

from liquid_splash_addon.blender.data.properties import is_splash
from liquid_splash_addon.blender.scene import sketch as sketches
from liquid_splash_addon.core.condition.channels import STROKE_VELOCITY
from liquid_splash_addon.core.condition.patches.sampling import PatchSamples
from liquid_splash_addon.core.condition.voxelize import Condition, voxelize
from liquid_splash_addon.core.grid import Grid
from liquid_splash_addon.core.liquid.fields import AIR, Fields
from liquid_splash_addon.core.refinement.presets import BARE
from liquid_splash_addon.core.sketch.drawing import Drawing
from liquid_splash_addon.core.sketch.strokes import Stroke

SIZE, GAIN = 0.32, 4.0
"""Real size of the tests' splashes, metres, and their speed gain: what they find does not hang on
the defaults."""


class TubeGenerator:
    """Liquid in tubes around the strokes, as fast as they are; the latent makes it bumpy."""

    weights_hash = "0123456789abcdef"
    precision = "float32"
    device = "cpu"
    fastest = 5.0
    config = SimpleNamespace(latent_channels=2, latent_cells=8)
    radius = 1.7
    """Of the tubes, in cells of a draft."""

    def condition(self, strokes: Sequence[Stroke], grid: Grid) -> Condition:
        """Return the strokes on the grid, without patches: tubes know of none."""
        return voxelize(strokes, grid, PatchSamples.none())

    def generate(
        self,
        condition: Condition,
        grid: Grid,
        latent: np.ndarray | None = None,
        obstacle: np.ndarray | None = None,
    ) -> Fields:
        """Return the tubes, as ``core.generator.Generator.generate`` returns a splash."""
        self.obstacle = obstacle
        away, nearest = distance_transform_edt(~condition.drawn, return_indices=True)
        distance = gaussian_filter(away, 1.2) - self.radius * grid.shape[0] / 64
        if latent is not None:
            distance += zoom(latent[1], grid.shape[0] // latent.shape[1], order=1)
        distance = np.clip(distance, -AIR, AIR).astype(np.float32)
        velocity = condition.dense()[STROKE_VELOCITY][(slice(None), *nearest)] * (distance < AIR)
        return Fields(1 / (1 + np.exp(2 * distance)), distance, velocity, grid)


def line(start, stop, speed=1.0, points=60, pressure=None) -> Drawing:
    """Return a straight drawing at constant speed, Blender units."""
    share = np.linspace(0, 1, points)
    start, stop = np.asarray(start, dtype=float), np.asarray(stop, dtype=float)
    times = share * np.linalg.norm(stop - start) / speed
    pressures = None if pressure is None else np.full(points, float(pressure))
    return Drawing(start + share[:, None] * (stop - start), times, pressures)


def bend(speed=2.0, points=90, height=0.0) -> Drawing:
    """Return three quarters of a circle of radius 1 at constant speed."""
    angle = np.linspace(0, 1.5 * np.pi, points)
    path = np.stack([np.cos(angle), np.sin(angle), height + 0.3 * angle], axis=1)
    return Drawing(path, angle * np.hypot(1, 0.3) / speed)


def fan(speed=2.0, size=1.0) -> list[Drawing]:
    """Return strokes that fan out from the origin: three clearly different variances."""
    angles = 0.5 * np.linspace(-1, 1, 6)
    tips = size * np.stack([np.cos(angles), np.sin(angles), 0.15 * np.sin(7 * angles)], axis=1)
    return [line((0, 0.1 * size * a, 0), tip, speed) for a, tip in zip(angles, tips, strict=True)]


def slower(drawings: Sequence[Drawing], factor: float) -> list[Drawing]:
    """Return the same drawings, each taking ``factor`` times as long."""
    return [Drawing(d.points, d.times * factor, d.pressures) for d in drawings]


def moved(drawings: Sequence[Drawing], matrix: Matrix) -> list[Drawing]:
    """Return the drawings with their points moved by ``matrix``."""
    m = np.array(matrix)
    return [Drawing(d.points @ m[:3, :3].T + m[:3, 3], d.times, d.pressures) for d in drawings]


def add_sketch(
    drawings: Sequence[Drawing], matrix: Matrix | None = None, active: bool = True
) -> bpy.types.Object:
    """Return a Grease Pencil object with ``drawings`` as its strokes."""
    sketch = sketches.new_sketch(bpy.context, matrix or Matrix())
    if drawings:
        sketches.add_strokes(sketch, drawings)
    if active:
        bpy.context.view_layer.objects.active = sketch
    return sketch


def vertices(splash: bpy.types.Object, name: str = "position") -> np.ndarray:
    """Return a vector attribute of a mesh object's points, ``(n, 3)``."""
    values = np.empty((len(splash.data.vertices), 3), dtype=np.float32)
    splash.data.attributes[name].data.foreach_get("vector", values.ravel())
    return values


def real_velocities(splash: bpy.types.Object) -> np.ndarray:
    """Return the velocities of a splash or a model as they would be in real time, ``(n, 3)``."""
    return vertices(splash, "velocity") / splash.splash_motion.time_scale


def evaluated_mesh(item: bpy.types.Object) -> dict[str, np.ndarray]:
    """Return the attributes of the points of an object's mesh, its modifiers applied, by name."""
    bpy.context.view_layer.update()
    mesh = item.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    found = {}
    for name, field, width in (("position", "vector", 3), ("velocity", "vector", 3),
                               ("radius", "value", 1)):  # fmt: skip
        if name in mesh.attributes:
            values = np.empty(len(mesh.vertices) * width, dtype=np.float32)
            mesh.attributes[name].data.foreach_get(field, values)
            found[name] = values.reshape(-1, 3) if width == 3 else values
    return found


def in_world(splash: bpy.types.Object) -> np.ndarray:
    """Return the splash's vertices in the world, ``(n, 3)``."""
    bpy.context.view_layer.update()
    matrix = np.array(splash.matrix_world)
    return vertices(splash) @ matrix[:3, :3].T + matrix[:3, 3]


def splashes() -> list[bpy.types.Object]:
    """Return all splash objects of the scene."""
    return list(filter(is_splash, bpy.context.scene.objects))


def generate(**settings: object) -> bpy.types.Object:
    """Run the button's operator, as a draft unless told otherwise, and return the splash.

    It is bare liquid: what new splashes start with is for the tests that are about it.
    """
    given = {"resolution": "64", "real_size": SIZE, "speed_gain": GAIN, "start": BARE, **settings}
    result = bpy.ops.splash.generate(**given)
    assert result == {"FINISHED"}
    return splashes()[0]
